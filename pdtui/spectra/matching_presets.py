"""The choices that matching leaves open: the presets, and what each choice may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, get_args, get_type_hints

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import PdtuiError

Window = Literal["blackman", "hann", "hamming", "rectangular"]

# Each window is a sum of cosines with these weights, and a constant fills as many bins from frequency 0 up.
_COSINES: dict[Window, tuple[float, ...]] = {
    "blackman": (0.42, 0.5, 0.08),
    "hann": (0.5, 0.5),
    "hamming": (0.54, 1 - 0.54),
    "rectangular": (1.0,),
}


@dataclass(frozen=True)
class MatchingPreset:
    """The choices that the method leaves open.

    Windows are periodic and lie wholly inside the series: window d starts at sample ``d·hop``, and nothing is
    padded. The transform is divided by the sum of the window, so that a constant c has |STFT| = c at
    frequency 0. This scales all distances alike and changes no rank.

    Attributes:
        name: name on the command line.
        window: shape of the window.
        length: length of the window, samples.
        hop: distance between the starts of windows, samples.
        spectrogram: ``power`` |STFT|² (section 3.2), or ``magnitude`` |STFT| (the authors' released code).
        scaling: scale of the series before the transform: ``observed``, attributes as the policy observes
            them; ``raw``, attributes in their physical units; ``standardized``, attributes and units minus
            their mean and divided by their standard deviation over all episodes.
        level: ``kept``, or ``removed`` to leave the bins that a constant fills out of distances.
        angles: ``unwrapped`` over time, or ``wrapped`` to (−π, π].
        predominant: frequency at which phases are compared: ``any``, the strongest of all as in the paper
            (for an attribute that is mostly mean level this is 0, and its "phase" the sign of the unit's
            mean), or ``moving``, the strongest above the bins that a constant fills.
        phase_mean: the ρ on which conclusions rest; both are reported. ``plain`` is the paper's, but is
            meaningless for phases near ±π.
        changed: differences from the preset of this name, as ``NAME=VALUE``.
    """

    name: str
    window: Window
    length: int
    hop: int
    spectrogram: Literal["power", "magnitude"]
    scaling: Literal["observed", "raw", "standardized"] = "observed"
    level: Literal["kept", "removed"] = "kept"
    angles: Literal["unwrapped", "wrapped"] = "unwrapped"
    predominant: Literal["any", "moving"] = "any"
    phase_mean: Literal["circular", "plain"] = "circular"
    changed: tuple[str, ...] = ()

    def __str__(self) -> str:
        return " ".join((self.name, *self.changed))

    @property
    def weights(self) -> Floats:
        """The window, divided by its sum, shape (length,).

        It is `scipy.signal.get_window`'s to the last bit, without the second that loading that takes: a drive
        whose spectra are looked at would feel it.
        """
        angles = np.linspace(-np.pi, np.pi, self.length + 1)
        window = np.zeros(self.length + 1)
        for times, weight in enumerate(_COSINES[self.window]):
            window += weight * np.cos(times * angles)
        window = window[:-1]
        window /= window.sum()
        return window

    @property
    def bins(self) -> int:
        """Number of frequencies, from 0 to half the sampling rate."""
        return self.length // 2 + 1

    @property
    def level_bins(self) -> int:
        """Number of bins, from frequency 0 up, that a constant fills with this window."""
        return len(_COSINES[self.window])

    @property
    def first_bin(self) -> int:
        """Lowest bin that distances include."""
        return self.level_bins if self.level == "removed" else 0

    @property
    def phase_from_bin(self) -> int:
        """Lowest bin that may be the predominant frequency."""
        return self.level_bins if self.predominant == "moving" or self.level == "removed" else 0

    def frequencies(self, dt: float) -> Floats:
        """Return the frequency of each bin in Hz for samples `dt` seconds apart, shape (F,)."""
        return np.asarray(np.fft.rfftfreq(self.length, dt), np.float64)


# Section 3.2 and appendix of the paper, and what its authors' released code computes.
PRESETS: dict[str, MatchingPreset] = {
    preset.name: preset
    for preset in (
        MatchingPreset("paper", "blackman", 64, 16, "power"),
        MatchingPreset("authors", "hann", 32, 8, "magnitude"),
    )
}
_RANGES = {"length": (4, 65536), "hop": (1, 65536)}


def allowed_preset_values() -> dict[str, tuple[str, ...] | tuple[int, int]]:
    """Return for each choice its possible values, or its lowest and highest number of samples."""
    hints = get_type_hints(MatchingPreset)
    named = {
        name: tuple(get_args(hint))
        for name, hint in hints.items()
        if name not in {"name", "changed", *_RANGES}
    }
    return {**named, **_RANGES}


def list_preset_values(preset: MatchingPreset) -> dict[str, Any]:
    """Return the choices of a preset by name."""
    everything = asdict(preset)
    return {name: everything[name] for name in everything if name in allowed_preset_values()}


def find_matching_preset(name: str, settings: Sequence[str] = ()) -> MatchingPreset:
    """Return a preset by name, with some of its choices changed.

    Each setting is ``NAME=VALUE``; the last one of a name counts.

    Raises:
        PdtuiError: there is no such preset or choice, or the choice does not allow that value.
    """
    if name not in PRESETS:
        raise PdtuiError(f"unknown preset '{name}'; available: {', '.join(PRESETS)}")
    values: dict[str, Any] = dict(_parse(setting) for setting in settings)
    preset, usual = PRESETS[name], list_preset_values(PRESETS[name])
    changed = tuple(f"{key}={value}" for key, value in values.items() if value != usual[key])
    preset = replace(preset, **values, changed=changed)
    if preset.hop > preset.length:
        raise PdtuiError(
            f"setting 'hop': expected at most the window's length, {preset.length}, so that no sample is "
            f"skipped; got {preset.hop}"
        )
    return preset


def describe_allowed_preset_values() -> str:
    """Return one line that lists all choices and their values."""
    return "; ".join(f"{name}={_describe_values(name)}" for name in allowed_preset_values())


def _parse(setting: str) -> tuple[str, str | int]:
    name, equals, value = (part.strip() for part in setting.partition("="))
    if not equals:
        raise PdtuiError(
            f"setting '{setting}': expected NAME=VALUE, one of {describe_allowed_preset_values()}"
        )
    if name not in allowed_preset_values():
        raise PdtuiError(f"unknown setting '{name}'; available: {describe_allowed_preset_values()}")
    if name in _RANGES:
        low, high = _RANGES[name]
        if value.isdecimal() and low <= int(value) <= high:
            return name, int(value)
    elif value in allowed_preset_values()[name]:
        return name, value
    raise PdtuiError(f"setting '{name}': expected {_describe_values(name)}, got '{value}'")


def _describe_values(name: str) -> str:
    if name in _RANGES:
        low, high = _RANGES[name]
        return f"{low}…{high} samples"
    return "|".join(str(value) for value in allowed_preset_values()[name])
