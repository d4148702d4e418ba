"""Finds what keys do from drives with random keys: the responses that predict best where it comes to.

From many moments of the drives, the second that follows is predicted; the squared errors of all predictions
are minimised, stretches where the robot stumbled counting less (soft L1). So the responses fit what the
planner does with them: predict over changes of keys, not only while one is held.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pdtui.core.angles import wrap_angle
from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError
from pdtui.paper.forest.key_motion_model import (
    LOOKS_BACK,
    KeyMotionModel,
    ObservedDrive,
    RobotMotion,
    estimate_motion,
    roll_drift,
    roll_heading,
    roll_speed,
)

_AHEAD = 1.2
"""How far is predicted, s."""
_EVERY = 10
_STRIDE = 4
_LEAST = 8
_GUESS = ((0.0, 0.5, 0.2), (1.0, 1.0), (0.0, 0.3))
_LOW = ((-8.0, 0.0, 0.03), (0.0, 0.05), (-1.0, 0.05))
_HIGH = ((8.0, 8.0, 1.0), (12.0, 5.0), (1.0, 1.5))


@dataclass(frozen=True)
class _Stretches:
    """N stretches of T strides: what was seen before, what was latched, and what came.

    Attributes:
        starts: before each, N of them.
        choices: shape (T, N).
        headings, speeds, drifts: after each stride, shapes (T, N).
    """

    starts: tuple[RobotMotion, ...]
    choices: NDArray[np.int64]
    headings: Floats
    speeds: Floats
    drifts: Floats

    def before(self, name: str) -> Floats:
        return np.array([getattr(start, name) for start in self.starts])


def fit_key_motion_models(
    drives: Sequence[ObservedDrive], names: Sequence[str], dt: float
) -> dict[str, KeyMotionModel]:
    """The responses that predict the drives best.

    Args:
        drives: with every choice in some of them.
        names: of the choices, by their numbers.
        dt: s per control step.

    Raises:
        RobotError: the robot fell before enough was seen of a choice.
    """
    falls = [_falls(drives, number) for number in range(len(names))]
    seen = _stretches(drives, dt)
    for number, name in enumerate(names):
        count = int((seen.choices == number).any(axis=0).sum()) if seen.starts else 0
        if count < _LEAST:
            raise RobotError(
                f"'{name}': the robot was seen with it in {count} stretches of {_AHEAD} s, expected were "
                f"{_LEAST}; it fell {falls[number][0]} times in {falls[number][1]} presses"
            )
    pace = _STRIDE * dt

    def heading_errors(table: Floats) -> Floats:
        found = roll_heading(table[seen.choices], seen.before("heading"), seen.before("rate"), pace)[0]
        return found - seen.headings

    def speed_errors(table: Floats) -> Floats:
        return roll_speed(table[seen.choices], seen.before("speed"), pace) - seen.speeds

    def drift_errors(table: Floats) -> Floats:
        found = roll_drift(table[seen.choices], seen.before("drift"), pace)
        return (found - seen.drifts) * np.minimum(seen.speeds, 1.0)

    tables = [
        _minimise(errors, len(names), *bounds)
        for errors, *bounds in zip(
            (heading_errors, speed_errors, drift_errors), _GUESS, _LOW, _HIGH, strict=True
        )
    ]
    rows = np.hstack(tables)
    responses = {}
    for name, row, (fell, presses) in zip(names, rows, falls, strict=True):
        pull, hold, lag, drive, drag, slip, settle = row.tolist()
        fallen = fell / max(presses, 1)
        responses[name] = KeyMotionModel(pull, hold, lag, drive, drag, slip, settle, fallen)
    return responses


def _minimise(
    errors: Callable[[Floats], Floats],
    choices: int,
    guess: Sequence[float],
    low: Sequence[float],
    high: Sequence[float],
) -> Floats:
    """The table, shape (choices, P), with the least errors."""
    shape = (choices, len(guess))

    def flat_errors(flat: Floats) -> Floats:
        return errors(flat.reshape(shape)).ravel()

    found = least_squares(
        flat_errors,
        np.tile(guess, choices),
        bounds=(np.tile(low, choices), np.tile(high, choices)),
        loss="soft_l1",
        f_scale=0.2,
    )
    table: Floats = found.x.reshape(shape)
    return table


def _falls(drives: Sequence[ObservedDrive], number: int) -> tuple[int, int]:
    """Falls with a choice, and presses of it."""
    falls = presses = 0
    for drive in drives:
        latched = drive.choices == number
        presses += int((latched & np.diff(drive.choices, prepend=-1).astype(bool)).sum())
        falls += bool(drive.fell and latched[-1])
    return falls, presses


def _stretches(drives: Sequence[ObservedDrive], dt: float) -> _Stretches:
    starts, choices, headings, speeds, drifts = [], [], [], [], []
    strides, half = round(_AHEAD / (_STRIDE * dt)), LOOKS_BACK // 2
    length = strides * _STRIDE
    for drive in drives:
        path = drive.places.copy()
        path[:, 2] = np.unwrap(path[:, 2])
        for first in range(LOOKS_BACK, len(drive.choices) - length - half, _EVERY):
            start = estimate_motion(path[: first + 1], dt)
            after = first + _STRIDE * np.arange(1, strides + 1)
            moved = (path[after + half, :2] - path[after - half, :2]) / (2 * half * dt)
            turns = wrap_angle(float(path[first, 2])) - path[first, 2]
            course = np.arctan2(moved[:, 1], moved[:, 0])
            starts.append(start)
            choices.append(drive.choices[after - _STRIDE // 2])
            headings.append(path[after, 2] + turns)
            speeds.append(np.hypot(moved[:, 0], moved[:, 1]))
            drifts.append(np.angle(np.exp(1j * (course - path[after, 2]))))
    return _Stretches(
        tuple(starts),
        np.array(choices, int).T,
        np.array(headings).T,
        np.array(speeds).T,
        np.array(drifts).T,
    )
