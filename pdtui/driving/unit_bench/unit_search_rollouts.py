"""What runs in the process of a search for units: roll-outs from one moment of the drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import is_failure
from pdtui.core.units import Stimulation, format_unit
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.ghost.ghost_simulation import GhostStart, restore_ghost_start
from pdtui.driving.unit_bench.natural_ranges import NaturalRanges
from pdtui.driving.unit_bench.unit_search_snapshot import FoundUnit

SECONDS = 2.0
"""Simulated time of a roll-out, s; its second half is measured."""
_MOST_TRIED = 2000
"""Units of whose effect on the action is asked; of a larger network, a random choice."""
_BEYOND = 0.5  # of a natural range by which the outputs that are tried lie beyond it


@dataclass(frozen=True)
class UnitTrial:
    """What a roll-out measured: the attribute, whether the robot failed, and in how many control steps."""

    mean: float
    failed: bool
    steps: int


@dataclass(frozen=True)
class UnitCandidate:
    """A unit and an output v that are worth a roll-out."""

    unit: int
    value: float


def rank_candidates(
    loop: ControlLoop, start: GhostStart, ranges: NaturalRanges | None
) -> list[UnitCandidate]:
    """Return units and outputs, those first that change the policy's action at the start the most.

    Each unit is tried a bit beyond either end of its natural range. The action is computed without the robot.
    """
    restore_ghost_start(loop, start)
    policy, observation = loop.policy, loop.robot.observe()
    state = policy.snapshot()

    def act(stimulation: Stimulation) -> Floats:
        policy.restore(state)
        return np.array(policy.act(observation, stimulation).action, np.float64)

    plain = act(Stimulation())
    low, high = (np.full(policy.units, -1.0), np.full(policy.units, 1.0)) if ranges is None else ranges[:2]
    beyond = _BEYOND * np.maximum(high - low, 0.1)
    outputs = np.stack([low - beyond, high + beyond])
    units = np.arange(policy.units)
    if policy.units > _MOST_TRIED:
        units = np.sort(np.random.default_rng(start.step).choice(units, _MOST_TRIED, replace=False))
    found = [
        (-float(np.abs(act(Stimulation((unit,), (value,))) - plain).sum()), UnitCandidate(unit, value))
        for unit in units.tolist()
        for value in (round(float(one), 3) for one in outputs[:, unit])
    ]
    policy.restore(state)
    return [candidate for _, candidate in sorted(found, key=lambda pair: pair[0])]


def run_search_rollout(
    loop: ControlLoop, start: GhostStart, column: int, candidate: UnitCandidate | None
) -> UnitTrial:
    """Run the drive on from a start, with the unit held or without it, and measure an attribute.

    Args:
        loop: a loop of the same drive, with the same behaviors latched as in the start.
        start: where the roll-out begins.
        column: column of the attribute.
        candidate: the unit and its output; None for none.

    Returns:
        The mean of the attribute over the second half; for an angle, of the angle turned since the start.
    """
    restore_ghost_start(loop, start)
    steps = max(2, round(SECONDS / loop.robot.control_dt))
    events: list[DriveEvent] = []
    if candidate is not None:
        address = format_unit(candidate.unit, loop.policy.layers)
        events = [DriveEvent(loop.step, "unit", address, candidate.value)]
    wraps, before = loop.robot.attributes[column].wraps, float(loop.attributes[column])
    turned, measured = 0.0, list[float]()
    for step in range(steps):
        record = loop.advance(events)
        events, now = [], float(record.attributes[column])
        turned += wrap_angle(now - before)
        before = now
        if step >= steps // 2:
            measured.append(turned if wraps else now)
        if record.ended:
            return UnitTrial(_mean(measured), is_failure(record.outcome), steps)
    return UnitTrial(_mean(measured), False, steps)


def judge_rollout(candidate: UnitCandidate, found: UnitTrial, plain: UnitTrial) -> FoundUnit | None:
    """Return what a candidate does compared with the drive without it; None where that was not measured."""
    effect = found.mean - plain.mean
    if not np.isfinite(effect):
        return None
    return FoundUnit(candidate.unit, candidate.value, effect, found.failed and not plain.failed)


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
