from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import ShortTimeFFT, get_window

from pdtui.spectra.matching_presets import PRESETS, MatchingPreset
from pdtui.spectra.spectrogram import short_time_transform, spectrogram


@pytest.fixture(params=list(PRESETS))
def preset(request: pytest.FixtureRequest) -> MatchingPreset:
    return PRESETS[request.param]


def test_agrees_with_scipy_on_windows_that_lie_inside_the_series(preset: MatchingPreset) -> None:
    series = np.random.default_rng(0).standard_normal((300, 4))
    window = get_window(preset.window, preset.length, fftbins=True)
    reference = ShortTimeFFT(window, preset.hop, fs=1.0, scale_to="magnitude", phase_shift=None)
    whole = (300 - preset.length) // preset.hop + 1
    # scipy centers slice p on sample p·hop: ours starts there.
    first = (preset.length // 2) // preset.hop
    expected = reference.stft(series, p0=first, p1=first + whole, axis=0).transpose(1, 2, 0)
    np.testing.assert_allclose(short_time_transform(series, preset), expected, atol=1e-12)


def test_agrees_with_the_formula_written_out(preset: MatchingPreset) -> None:
    series = np.random.default_rng(1).standard_normal(preset.length + 2 * preset.hop)
    window = get_window(preset.window, preset.length, fftbins=True)
    spectra = short_time_transform(series[:, None], preset)
    assert spectra.shape == (1, 3, preset.length // 2 + 1)
    for d in range(3):
        for bin_ in (0, 1, 7, preset.length // 2):
            total = 0j
            for t in range(preset.length):
                turn = np.exp(-2j * np.pi * bin_ * t / preset.length)
                total += window[t] * series[d * preset.hop + t] * turn
            assert spectra[0, d, bin_] == pytest.approx(total / window.sum(), abs=1e-12)


def test_sine_at_a_bin_is_known_by_hand(preset: MatchingPreset) -> None:
    time = np.arange(4 * preset.length)
    sine = 3.0 * np.cos(2 * np.pi * 8 * time / preset.length)
    magnitude = np.abs(short_time_transform(sine[:, None], preset))[0]
    # Half the amplitude at the sine's bin; its neighbors hold the window's own side lines.
    side = 0.25 / 0.42 if preset.window == "blackman" else 0.25 / 0.5
    np.testing.assert_allclose(magnitude[:, 8], 1.5, atol=1e-12)
    np.testing.assert_allclose(magnitude[:, [7, 9]], 1.5 * side, atol=1e-12)
    far = [bin_ for bin_ in range(preset.bins) if abs(bin_ - 8) >= preset.level_bins]
    np.testing.assert_allclose(magnitude[:, far], 0.0, atol=1e-12)
    expected = 1.5**2 if preset.spectrogram == "power" else 1.5
    assert spectrogram(short_time_transform(sine[:, None], preset), preset)[0, 0, 8] == pytest.approx(
        expected
    )


def test_a_constant_fills_the_level_bins_and_no_other(preset: MatchingPreset) -> None:
    magnitude = np.abs(short_time_transform(np.full((preset.length, 1), 2.5), preset))[0, 0]
    assert magnitude[0] == pytest.approx(2.5)
    assert (magnitude[: preset.level_bins] > 0.05).all()
    np.testing.assert_allclose(magnitude[preset.level_bins :], 0.0, atol=1e-12)


def test_frequencies_are_in_hertz(preset: MatchingPreset) -> None:
    assert preset.frequencies(0.05)[-1] == pytest.approx(10.0)
    assert preset.frequencies(0.05)[1] == pytest.approx(20.0 / preset.length)


def test_a_series_shorter_than_a_window_has_no_window(preset: MatchingPreset) -> None:
    assert short_time_transform(np.zeros((preset.length - 1, 3)), preset).shape == (3, 0, preset.bins)
