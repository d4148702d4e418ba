from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import Attribute
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching_presets import PRESETS, MatchingPreset, find_matching_preset
from pdtui.spectra.phase_correlation import correlate_phases, phase_correlation
from pdtui.spectra.spectrogram import short_time_transform

SPEED = (Attribute("speed", "m/s"),)


def wave(phase: float, steps: int = 320) -> np.ndarray:
    """A cosine of eight periods in 64 samples: a bin of both presets."""
    return np.cos(2 * np.pi * np.arange(steps) / 8 + phase)


def episode(*units: np.ndarray) -> MonitoredEpisode:
    return MonitoredEpisode(0, np.column_stack(units).astype(np.float32), wave(0.0)[:, None])


def test_the_formula_of_the_paper() -> None:
    phases = np.array([0.0, np.pi / 4, np.pi / 2, -np.pi / 2, np.pi, -np.pi])
    np.testing.assert_allclose(phase_correlation(phases), [1.0, 0.5, 0.0, 0.0, -1.0, -1.0])


@pytest.mark.parametrize("preset", PRESETS.values(), ids=list(PRESETS))
def test_known_shifts_give_known_correlations(preset: MatchingPreset) -> None:
    shifts = (0.0, np.pi / 4, np.pi / 2, -np.pi / 2, 3.0)
    found = correlate_phases([episode(*(wave(shift) for shift in shifts))], SPEED, preset)
    assert found.bins[0] == preset.length // 8
    expected = [1.0, 0.5, 0.0, 0.0, 1 - 6 / np.pi]
    np.testing.assert_allclose(found.plain[0], expected, atol=1e-6)
    np.testing.assert_allclose(found.circular[0], expected, atol=1e-6)
    assert not found.disagree.any()


def test_circular_mean_survives_the_wrap_where_the_plain_one_does_not() -> None:
    one, other = episode(wave(np.pi - 0.2)), episode(wave(-np.pi + 0.2))
    found = correlate_phases([one, other], SPEED, PRESETS["paper"])
    assert found.circular[0, 0] == pytest.approx(-1.0, abs=1e-6)
    # Half the phases are π − 0.2 and half −π + 0.2: their plain mean is 0, "in phase".
    assert found.plain[0, 0] == pytest.approx(1.0, abs=1e-6)
    assert found.disagree[0, 0]


def test_a_silent_unit_has_no_phase() -> None:
    found = correlate_phases([episode(wave(0.0), np.zeros(320))], SPEED, PRESETS["paper"])
    assert found.circular[0, 0] == pytest.approx(1.0)
    assert np.isnan(found.plain[0, 1])
    assert np.isnan(found.circular[0, 1])


def test_a_mean_level_is_the_predominant_frequency_of_an_attribute_that_has_one() -> None:
    attribute = 5.0 + wave(0.0)
    activations = np.column_stack([0.5 + wave(1.0), -0.5 + wave(0.0)]).astype(np.float32)
    found = correlate_phases([MonitoredEpisode(0, activations, attribute[:, None])], SPEED, PRESETS["paper"])
    assert found.bins[0] == 0
    np.testing.assert_allclose(found.circular[0], [1.0, -1.0])


def test_the_predominant_frequency_can_be_that_of_the_movement() -> None:
    activations = np.column_stack([0.5 + wave(1.0), -0.5 + wave(0.0)]).astype(np.float32)
    level = MonitoredEpisode(0, activations, (5.0 + wave(0.0))[:, None])
    for setting in ("predominant=moving", "level=removed"):
        found = correlate_phases([level], SPEED, find_matching_preset("paper", [setting]), block=1)
        assert found.bins[0] == 8
        np.testing.assert_allclose(found.circular[0], [1 - 2 / np.pi, 1.0], atol=1e-6)


def test_the_preset_says_which_mean_counts() -> None:
    found = correlate_phases(
        [episode(wave(np.pi - 0.2)), episode(wave(0.2 - np.pi))], SPEED, PRESETS["paper"]
    )
    assert found.rho(PRESETS["paper"])[0, 0] == found.circular[0, 0]
    assert found.rho(find_matching_preset("paper", ["phase_mean=plain"]))[0, 0] == found.plain[0, 0]


@pytest.mark.parametrize("preset", PRESETS.values(), ids=list(PRESETS))
def test_both_means_are_those_of_the_phases_of_each_window(preset: MatchingPreset) -> None:
    rng = np.random.default_rng(5)
    attributes = rng.standard_normal((2, 320, 3)).cumsum(axis=1) + np.array([0.0, 40.0, 0.0])
    activations = np.tanh(rng.standard_normal((2, 320, 70)).cumsum(axis=1)).astype(np.float32)
    activations[:, 100:250, 7] = 0.0  # silent in some windows
    activations[:, :, 8] = 0.0
    known = tuple(Attribute(name, "") for name in "abc")
    episodes = [MonitoredEpisode(seed, activations[seed], attributes[seed]) for seed in range(2)]
    found = correlate_phases(episodes, known, preset, block=16)
    for row in range(3):
        waves = [short_time_transform(one[:, [row]], preset)[0] for one in attributes]
        predominant = int(np.argmax(sum(np.square(np.abs(wave)).sum(axis=0) for wave in waves)))
        assert found.bins[row] == predominant
        for unit in range(70):
            spectra = [short_time_transform(one[:, [unit]], preset)[0] for one in activations]
            product = np.concatenate(
                [
                    spectrum[:, predominant] * wave[:, predominant].conj()
                    for spectrum, wave in zip(spectra, waves, strict=True)
                ]
            )
            product = product[np.abs(product) > 1e-12]
            if unit == 8:
                assert np.isnan(found.plain[row, unit])
                continue
            phases = np.where(np.angle(product) == -np.pi, np.pi, np.angle(product))
            plain, phasor = np.mean(phases), np.mean(product / np.abs(product))
            circular = np.angle(phasor) if abs(phasor) > 1e-9 else 0.0
            assert found.plain[row, unit] == pytest.approx(1 - abs(2 * plain) / np.pi, abs=1e-9)
            assert found.circular[row, unit] == pytest.approx(1 - abs(2 * circular) / np.pi, abs=1e-9)


def test_an_attribute_and_its_negative_are_in_antiphase_at_every_window() -> None:
    moving = np.random.default_rng(6).standard_normal(320).astype(np.float32)
    one = MonitoredEpisode(0, -moving[:, None], moving[:, None].astype(np.float64))
    found = correlate_phases([one], SPEED, PRESETS["paper"])
    assert found.plain[0, 0] == pytest.approx(-1.0)
    assert found.circular[0, 0] == pytest.approx(-1.0)
