"""Figures over time of a behavior's effect, from runs with it and runs of the same seeds without."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Attribute, BehaviorAim, Floats
from pdtui.evaluation.held_run import HeldRunTrace
from pdtui.evaluation.paired_statistics import sign_flip_p_value, studentized_interval
from pdtui.evaluation.protocol_settings import RunTimes

ONSET_SECONDS = 0.5
"""Effects are averaged over this time before their onset is read, because strides swing them."""
GAIT_ATTRIBUTES = ("speed", "height", "yaw rate", "pitch")
"""Attributes by which the usual gait is recognized, whatever the course."""
_GAIT_SPREADS, _GAIT_SHARE = 3.0, 0.1


@dataclass(frozen=True)
class WindowEffect:
    """The effect in one window; a run counts as 0 from its end on.

    Attributes:
        value, default: Means of the attribute with the behavior and without, over the runs that still go on.
        effect: Mean of the paired differences.
        low, high: 95 % interval of `effect` (studentized bootstrap over starts).
        p_value: That of a paired sign-flip test.
        corrected: The same, corrected over the rows of the table.
    """

    value: float
    default: float
    effect: float
    low: float
    high: float
    p_value: float
    corrected: float


@dataclass(frozen=True)
class EffectSpecificity:
    """The change over the whole hold, in standard deviations that attributes have in the default's walk.

    Attributes:
        wanted: Change of the aim's attribute.
        others: Mean change of the other attributes, all counted positive; angles that wrap, and attributes
            that never change, are left out.
        largest: Name of the other attribute that changes most; empty if there is none.
        specificity: `wanted` divided by `others`.
    """

    wanted: float
    others: float
    largest: str
    specificity: float


def paired_effects(traces: Sequence[HeldRunTrace], defaults: Sequence[HeldRunTrace], column: int) -> Floats:
    """Return the differences of an attribute by seed and bin, shape (n, bins); 0 where either has ended."""
    with_it, without = (np.array([one.values[:, column] for one in runs]) for runs in (traces, defaults))
    differences: Floats = np.nan_to_num(with_it - without[:, : with_it.shape[1]])
    return differences


def wanted_sign(aim: BehaviorAim, defaults: Sequence[HeldRunTrace], column: int) -> float:
    """Return the sign of the effect that an aim wants; for ``stop`` it is towards 0."""
    if aim.direction != "stop":
        return aim.sign
    usual = np.array([one.values[:, column] for one in defaults])
    return -1.0 if np.isnan(usual).all() or np.nanmean(usual) >= 0.0 else 1.0


def window_effect(
    traces: Sequence[HeldRunTrace], defaults: Sequence[HeldRunTrace], column: int, bins: slice
) -> WindowEffect:
    """Return the effect in a window, not yet corrected."""
    differences = paired_effects(traces, defaults, column)[:, bins].mean(axis=1)
    low, high = studentized_interval(differences)
    value, default = (
        _mean_of_finite(np.array([one.values[bins, column] for one in runs])) for runs in (traces, defaults)
    )
    p_value = sign_flip_p_value(differences)
    return WindowEffect(value, default, float(differences.mean()), low, high, p_value, p_value)


def onset_and_end(effect: Floats, times: RunTimes, sign: float) -> tuple[float, float]:
    """Return when the effect of one run first has half of its mean over the first window, and when no more.

    Args:
        effect: The paired difference at each bin from the press on, shape (bins,).
        times: The times of the run.
        sign: The sign of the wanted effect.

    Returns:
        Onset and end after the press, s. An effect of the wrong sign has an onset of NaN and ends at 0; one
        that is there at the release ends with the hold.
    """
    half = sign * float(effect[times.first_bins].mean()) / 2.0
    if half <= 0.0:
        return float("nan"), 0.0
    held, seconds = sign * effect[: times.held_bins], times.bin_seconds
    rises = _running_mean(held, max(1, round(ONSET_SECONDS / seconds)))
    # The end compares like with like: means as long as the first window, which noise does not lift to half.
    falls = _running_mean(held, times.first_bins.stop)
    there, left = np.flatnonzero(rises >= half), np.flatnonzero(falls >= half)
    onset = _middle(int(there[0]), held, rises) * seconds if len(there) else float("nan")
    if not len(left):
        return onset, 0.0
    whole = left[-1] == len(falls) - 1
    return onset, (len(held) if whole else _middle(int(left[-1]), held, falls)) * seconds


def _running_mean(values: Floats, width: int) -> Floats:
    width = min(width, len(values))
    return np.convolve(values, np.full(width, 1.0 / width), "valid")


def _middle(number: int, values: Floats, means: Floats) -> float:
    """Return the middle of a running mean, in bins from the first."""
    return number + (len(values) - len(means) + 1) / 2.0


def measure_side_effects(
    traces: Sequence[HeldRunTrace],
    defaults: Sequence[HeldRunTrace],
    attributes: Sequence[Attribute],
    column: int,
    times: RunTimes,
) -> EffectSpecificity:
    """Return the change of the wanted attribute and of the others over the whole hold."""
    changes = {}
    for other, attribute in enumerate(attributes):
        usual = np.array([one.values[:, other] for one in defaults])
        spread = float(np.nanstd(usual)) if np.isfinite(usual).any() else 0.0
        if spread > 0.0 and (other == column or not attribute.wraps):
            held = paired_effects(traces, defaults, other)[:, : times.held_bins]
            changes[attribute.name] = float(held.mean()) / spread
    wanted = changes.pop(attributes[column].name, float("nan"))
    if not changes:
        return EffectSpecificity(wanted, float("nan"), "", float("nan"))
    others = float(np.mean(np.abs(list(changes.values()))))
    largest = max(changes, key=lambda name: abs(changes[name]))
    return EffectSpecificity(wanted, others, largest, abs(wanted) / others if others > 0.0 else float("inf"))


def count_back_to_gait(
    traces: Sequence[HeldRunTrace],
    defaults: Sequence[HeldRunTrace],
    attributes: Sequence[Attribute],
    column: int,
) -> int:
    """Count the runs that are back to the usual gait in the last 2 s after the release.

    A run is back if speed, height, yaw rate and pitch (those that the robot has, or else the wanted
    attribute) are within three standard deviations of such 2 s means in runs without a press, or within a
    tenth of their mean.
    """
    names = [attribute.name for attribute in attributes]
    checked = [names.index(name) for name in GAIT_ATTRIBUTES if name in names] or [column]
    size = 8
    back = np.ones(len(traces), bool)
    for one in checked:
        usual = np.array([run.values[:, one] for run in defaults])
        whole = usual.shape[1] // size * size
        means = usual[:, :whole].reshape(len(usual), -1, size).mean(axis=2)
        if not np.isfinite(means).any():
            return 0
        middle, spread = float(np.nanmean(means)), float(np.nanstd(means))
        now = np.array([run.values[-size:, one].mean() for run in traces])
        back &= np.abs(now - middle) <= max(_GAIT_SPREADS * spread, _GAIT_SHARE * abs(middle))
    return int(back.sum())


def relative_spread(defaults: Sequence[HeldRunTrace], column: int, times: RunTimes) -> float:
    """Return the standard deviation over seeds of an attribute's first window, as a share of its mean."""
    means = np.array([one.values[times.first_bins, column].mean() for one in defaults])
    means = means[np.isfinite(means)]
    if len(means) < 2 or not means.mean():
        return float("nan")
    return float(means.std(ddof=1) / abs(means.mean()))


def _mean_of_finite(values: Floats) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
