"""Fits models of keys to drives with random keys.

From many moments of the drives, the 1.2 s that follow are predicted, and a soft L1 norm of the errors is
minimized, so that stumbles count less. The predictions span changes of keys, as those of the planner do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.core.errors import RobotError
from pdtui.core.outcome import is_failure
from pdtui.paper.forest.key_motion_model import (
    STEPS_OBSERVED,
    KeyMotionModel,
    ObservedDrive,
    RobotMotion,
    estimate_motion,
    integrate_drift,
    integrate_heading,
    integrate_speed,
)

_STRETCH = 1.2
"""Length of a predicted stretch, s."""
_STEPS_BETWEEN_STARTS = 10
_STEPS_PER_STRIDE = 4
"""Control steps per step of the integration."""
_FEWEST_STRETCHES = 8
"""Stretches with a key that a fit needs."""
_GUESS = ((0.0, 0.5, 0.2), (1.0, 1.0), (0.0, 0.3))
_LOW = ((-8.0, 0.0, 0.03), (0.0, 0.05), (-1.0, 0.05))
_HIGH = ((8.0, 8.0, 1.0), (12.0, 5.0), (1.0, 1.5))


@dataclass(frozen=True)
class _Stretches:
    """N stretches of T strides: the motion before, the latched keys, and the motion that followed.

    Attributes:
        starts: motion before each stretch, N of them.
        choices: index of the latched key in each stride, shape (T, N).
        headings, speeds, drifts: motion after each stride, shapes (T, N).
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
    """Fit the models that predict the drives best; each key, by its index in `names`, occurs in some of them.

    Raises:
        RobotError: there are too few stretches with a key, because the robot fell.
    """
    falls = [_falls(drives, number) for number in range(len(names))]
    seen = _stretches(drives, dt)
    for number, name in enumerate(names):
        count = int((seen.choices == number).any(axis=0).sum()) if seen.starts else 0
        if count < _FEWEST_STRETCHES:
            raise RobotError(
                f"'{name}': expected at least {_FEWEST_STRETCHES} stretches of {_STRETCH} s with this key, "
                f"found {count}; the robot fell {falls[number][0]} times in {falls[number][1]} presses"
            )
    pace = _STEPS_PER_STRIDE * dt

    def heading_errors(table: Floats) -> Floats:
        found = integrate_heading(table[seen.choices], seen.before("heading"), seen.before("rate"), pace)[0]
        return found - seen.headings

    def speed_errors(table: Floats) -> Floats:
        return integrate_speed(table[seen.choices], seen.before("speed"), pace) - seen.speeds

    def drift_errors(table: Floats) -> Floats:
        found = integrate_drift(table[seen.choices], seen.before("drift"), pace)
        return (found - seen.drifts) * np.minimum(seen.speeds, 1.0)

    errors = (heading_errors, speed_errors, drift_errors)
    tables = [
        _minimize(one, len(names), *bounds) for one, *bounds in zip(errors, _GUESS, _LOW, _HIGH, strict=True)
    ]
    tables.append(np.array([[fell / max(presses, 1)] for fell, presses in falls]))
    return {name: KeyMotionModel(*row.tolist()) for name, row in zip(names, np.hstack(tables), strict=True)}


def _minimize(
    errors: Callable[[Floats], Floats],
    choices: int,
    guess: Sequence[float],
    low: Sequence[float],
    high: Sequence[float],
) -> Floats:
    """Return the parameters with the least errors, shape (choices, P)."""
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
    return np.asarray(found.x.reshape(shape))


def _falls(drives: Sequence[ObservedDrive], number: int) -> tuple[int, int]:
    """Return the number of falls with a key and the number of its presses."""
    falls = presses = 0
    for drive in drives:
        latched = drive.choices == number
        presses += int((latched & np.diff(drive.choices, prepend=-1).astype(bool)).sum())
        falls += bool(is_failure(drive.outcome) and latched[-1])
    return falls, presses


def _stretches(drives: Sequence[ObservedDrive], dt: float) -> _Stretches:
    starts, choices, headings, speeds, drifts = [], [], [], [], []
    strides, half = round(_STRETCH / (_STEPS_PER_STRIDE * dt)), STEPS_OBSERVED // 2
    length = strides * _STEPS_PER_STRIDE
    for drive in drives:
        path = drive.places.copy()
        path[:, 2] = np.unwrap(path[:, 2])
        for first in range(STEPS_OBSERVED, len(drive.choices) - length - half, _STEPS_BETWEEN_STARTS):
            start = estimate_motion(path[: first + 1], dt)
            after = first + _STEPS_PER_STRIDE * np.arange(1, strides + 1)
            moved = (path[after + half, :2] - path[after - half, :2]) / (2 * half * dt)
            turns = wrap_angle(float(path[first, 2])) - path[first, 2]
            course = np.arctan2(moved[:, 1], moved[:, 0])
            starts.append(start)
            choices.append(drive.choices[after - _STEPS_PER_STRIDE // 2])
            headings.append(path[after, 2] + turns)
            speeds.append(np.hypot(moved[:, 0], moved[:, 1]))
            drifts.append(np.angle(np.exp(1j * (course - path[after, 2]))))
    return _Stretches(
        tuple(starts), np.array(choices, int).T, np.array(headings).T, np.array(speeds).T, np.array(drifts).T
    )
