"""The presets of matching, and what each of their choices may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, get_args, get_type_hints

from pdtui.dissection.spectrum import Preset
from pdtui.errors import PdtuiError

# Section 3.2 and appendix of the paper, and what its authors' released code computes.
PRESETS: dict[str, Preset] = {
    preset.name: preset
    for preset in (
        Preset("paper", "blackman", 64, 16, "power"),
        Preset("authors", "hann", 32, 8, "magnitude"),
    )
}
_RANGES = {"length": (4, 65536), "hop": (1, 65536)}


def choices() -> dict[str, tuple[str, ...] | tuple[int, int]]:
    """What can be set: for each name its values, or the lowest and highest of a number of samples."""
    hints = get_type_hints(Preset)
    named = {
        name: tuple(get_args(hint))
        for name, hint in hints.items()
        if name not in {"name", "changed", *_RANGES}
    }
    return {**named, **_RANGES}


def settings_of(preset: Preset) -> dict[str, Any]:
    """Every choice by the name under which it can be set."""
    everything = asdict(preset)
    return {name: everything[name] for name in everything if name in choices()}


def find_preset(name: str, settings: Sequence[str] = ()) -> Preset:
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
        f"{key}={value}" for key, value in values.items() if value != settings_of(PRESETS[name])[key]
    )
    preset = replace(preset, **values, changed=changed)
    if preset.hop > preset.length:
        raise PdtuiError(
            f"setting 'hop': expected at most the window's length, {preset.length}, so that no sample is "
            f"skipped; got {preset.hop}"
        )
    return preset


def describe_choices() -> str:
    """One line that lists every name and its values."""
    return "; ".join(f"{name}={_listed(name)}" for name in choices())


def _parse(setting: str) -> tuple[str, str | int]:
    name, equals, value = (part.strip() for part in setting.partition("="))
    if not equals:
        raise PdtuiError(f"setting '{setting}': expected NAME=VALUE, one of {describe_choices()}")
    if name not in choices():
        raise PdtuiError(f"unknown setting '{name}'; there are {describe_choices()}")
    if name in _RANGES:
        low, high = _RANGES[name]
        if not value.isdecimal() or not low <= int(value) <= high:
            raise PdtuiError(f"setting '{name}': expected {_listed(name)}, got '{value}'")
        return name, int(value)
    if value not in choices()[name]:
        raise PdtuiError(f"setting '{name}': expected {_listed(name)}, got '{value}'")
    return name, value


def _listed(name: str) -> str:
    if name in _RANGES:
        low, high = _RANGES[name]
        return f"{low}…{high} samples"
    return "|".join(str(value) for value in choices()[name])
