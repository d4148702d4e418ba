"""The presets of matching, and what each of their choices may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, get_args, get_type_hints

from pdtui.core.errors import PdtuiError
from pdtui.spectra.spectrogram import MatchingPreset

# Section 3.2 and appendix of the paper, and what its authors' released code computes.
PRESETS: dict[str, MatchingPreset] = {
    preset.name: preset
    for preset in (
        MatchingPreset("paper", "blackman", 64, 16, "power"),
        MatchingPreset("authors", "hann", 32, 8, "magnitude"),
    )
}
_RANGES = {"length": (4, 65536), "hop": (1, 65536)}


def preset_options() -> dict[str, tuple[str, ...] | tuple[int, int]]:
    """What can be set: for each name its values, or the lowest and highest of a number of samples."""
    hints = get_type_hints(MatchingPreset)
    named = {
        name: tuple(get_args(hint))
        for name, hint in hints.items()
        if name not in {"name", "changed", *_RANGES}
    }
    return {**named, **_RANGES}


def preset_values(preset: MatchingPreset) -> dict[str, Any]:
    """Every choice by the name under which it can be set."""
    everything = asdict(preset)
    return {name: everything[name] for name in everything if name in preset_options()}


def find_preset(name: str, settings: Sequence[str] = ()) -> MatchingPreset:
    """A preset by its name, with some of its choices changed.

    Args:
        name: ``paper`` or ``authors``.
        settings: ``NAME=VALUE`` each; the last of a name counts.

    Raises:
        PdtuiError: there is no preset or choice of that name, or the choice cannot be that.
    """
    if name not in PRESETS:
        raise PdtuiError(f"unknown preset '{name}'; there are {', '.join(PRESETS)}")
    preset = PRESETS[name]
    values: dict[str, Any] = dict(_parse(setting) for setting in settings)
    changed = tuple(
        f"{key}={value}" for key, value in values.items() if value != preset_values(PRESETS[name])[key]
    )
    preset = replace(preset, **values, changed=changed)
    if preset.hop > preset.length:
        raise PdtuiError(
            f"setting 'hop': expected at most the window's length, {preset.length}, so that no sample is "
            f"skipped; got {preset.hop}"
        )
    return preset


def describe_preset_options() -> str:
    """One line that lists every name and its values."""
    return "; ".join(f"{name}={_listed(name)}" for name in preset_options())


def _parse(setting: str) -> tuple[str, str | int]:
    name, equals, value = (part.strip() for part in setting.partition("="))
    if not equals:
        raise PdtuiError(f"setting '{setting}': expected NAME=VALUE, one of {describe_preset_options()}")
    if name not in preset_options():
        raise PdtuiError(f"unknown setting '{name}'; there are {describe_preset_options()}")
    if name in _RANGES:
        low, high = _RANGES[name]
        if not value.isdecimal() or not low <= int(value) <= high:
            raise PdtuiError(f"setting '{name}': expected {_listed(name)}, got '{value}'")
        return name, int(value)
    if value not in preset_options()[name]:
        raise PdtuiError(f"setting '{name}': expected {_listed(name)}, got '{value}'")
    return name, value


def _listed(name: str) -> str:
    if name in _RANGES:
        low, high = _RANGES[name]
        return f"{low}…{high} samples"
    return "|".join(str(value) for value in preset_options()[name])
