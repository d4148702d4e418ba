"""The loop that matching is compared with: it transforms each series and compares each pair by itself."""

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
    """Import librosa, which only this comparison needs.

    Raises:
        PdtuiError: librosa is not installed.
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
    """Compute the discrepancies by one `librosa.stft` per series and one `numpy.linalg.norm` per pair.

    Window, length and hop are those of the preset, without padding (``center=False``), in double precision.
    Each series is transformed once per episode, not once per pair. librosa does not divide by the sum of the
    window; that is done at the end, so that the numbers can be compared.

    Args:
        librosa: the library.
        episodes: recorded episodes, each at least one window long.
        attributes: attributes of the episodes; their scales apply.
        preset: window, length, hop, and power or magnitude.

    Returns:
        Discrepancies, shape (J, U).
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
