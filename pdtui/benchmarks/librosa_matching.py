"""What matching is compared with: a loop that transforms series by series and compares pair by pair."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.signal import get_window

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PdtuiError
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.monitor import MonitoredEpisode


def load_librosa() -> Any:
    """The library, which only this comparison needs.

    Raises:
        PdtuiError: it is not installed.
    """
    try:
        import librosa
    except ImportError as error:
        raise PdtuiError(
            "librosa is not installed, and the benchmark compares with it: pip install 'pdtui[bench]'"
        ) from error
    return librosa


def match_by_loop(
    librosa: Any,
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    preset: MatchingPreset,
) -> Floats:
    """The discrepancies of `match`, by one `librosa.stft` a series and one `numpy.linalg.norm` a pair.

    The same window, length and hop, with no padding (``center=False``), in double precision. Each series is
    transformed once an episode, not once a pair. librosa does not divide by the window's sum: the result is,
    at the end, so that the numbers can be compared too.

    Args:
        librosa: the library.
        episodes: each at least one window long.
        attributes: their scales apply.
        preset: window, length, hop, and power or magnitude.

    Returns:
        shape (J, U).
    """
    exponent = 2 if preset.spectrogram == "power" else 1
    window = {"rectangular": "boxcar"}.get(preset.window, preset.window)

    def spectrogram(series: Floats) -> Floats:
        spectra = librosa.stft(
            series, n_fft=preset.length, hop_length=preset.hop, window=window, center=False
        )
        result: Floats = np.abs(spectra) ** exponent
        return result

    total = np.zeros((len(attributes), episodes[0].activations.shape[1]))
    for episode in episodes:
        targets = [
            spectrogram(episode.attributes[:, column] * attribute.scale)
            for column, attribute in enumerate(attributes)
        ]
        for unit in range(total.shape[1]):
            one = spectrogram(episode.activations[:, unit].astype(np.float64))
            for row, target in enumerate(targets):
                total[row, unit] += np.linalg.norm(one - target)
    factor = float(get_window(window, preset.length).sum()) ** exponent
    return total / (len(episodes) * factor)
