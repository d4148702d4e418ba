"""How keys steer a robot: a first-order model of its heading and speed, fitted to drives.

What a key does differs from map to map, so that whoever drives may not rely on numbers written down here. A
few drives with random keys give them: for each, ``heading' = pull − hold · heading`` and
``speed' = drive − drag · speed``. A policy that turns on and on has no hold; one that sees its heading and
comes back to it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.errors import RobotError
from pdtui.robots.geometry import wrap_angle
from pdtui.robots.types import Floats

_WINDOW = 12
_LEAST = 8


@dataclass(frozen=True)
class Response:
    """What the robot does while one key is latched.

    Attributes:
        pull, hold: of the heading against +x, rad/s and 1/s.
        drive, drag: of the speed, m/s² and 1/s.
        slip: direction of motion less heading, rad.
        falls: of the drives, for each press.
    """

    pull: float
    hold: float
    drive: float
    drag: float
    slip: float
    falls: float


@dataclass(frozen=True)
class DrivenSteps:
    """One drive of S steps, as one sees it.

    Attributes:
        places: x and y in m and heading in rad before each step and after the last, shape (S + 1, 3).
        choices: number of the choice that was latched in each step, shape (S,).
        fell: whether it ended with a fall.
    """

    places: Floats
    choices: NDArray[np.int64]
    fell: bool


@dataclass(frozen=True)
class Place:
    """Where a robot is: x and y in m, heading in rad, speed in m/s."""

    x: float
    y: float
    heading: float
    speed: float


def fit_responses(drives: Sequence[DrivenSteps], names: Sequence[str], dt: float) -> dict[str, Response]:
    """Least squares over all windows in which one choice is latched.

    Args:
        drives: with every choice in some of them.
        names: of the choices, by their numbers.
        dt: s per control step.

    Raises:
        RobotError: the robot fell before enough was seen of a choice.
    """
    return {name: _fit(drives, number, name, dt) for number, name in enumerate(names)}


def _fit(drives: Sequence[DrivenSteps], number: int, name: str, dt: float) -> Response:
    headings, turns, speeds, gains, slips = [], [], [], [], []
    presses = falls = 0
    for drive in drives:
        latched = drive.choices == number
        presses += int((latched & np.diff(drive.choices, prepend=-1).astype(bool)).sum())
        falls += bool(drive.fell and latched[-1])
        heading = np.unwrap(drive.places[:, 2])
        heading += wrap_angle(heading[0]) - heading[0]
        for first in range(0, len(latched) - 2 * _WINDOW, _WINDOW // 2):
            middle, last = first + _WINDOW, first + 2 * _WINDOW
            if not latched[first:last].all():
                continue
            before, after = (drive.places[[middle, last], :2] - drive.places[[first, middle], :2]) / (
                _WINDOW * dt
            )
            speed, later = np.hypot(*before), np.hypot(*after)
            headings.append(heading[first : last + 1].mean())
            turns.append((heading[last] - heading[first]) / (2 * _WINDOW * dt))
            speeds.append((speed + later) / 2)
            gains.append((later - speed) / (_WINDOW * dt))
            slips.append(later * wrap_angle(np.arctan2(after[1], after[0]) - heading[middle:last].mean()))
    if len(turns) < _LEAST:
        raise RobotError(
            f"'{name}': the robot was seen with it for {len(turns)} stretches of {2 * _WINDOW} steps, "
            f"expected were {_LEAST}; it fell {falls} times in {presses} presses"
        )
    pull, hold = _line(np.array(headings), np.array(turns))
    drive_, drag = _line(np.array(speeds), np.array(gains))
    slip = float(np.sum(slips) / max(np.sum(speeds), 1e-9))
    return Response(pull, hold, drive_, drag, slip, falls / presses)


def _line(values: Floats, changes: Floats) -> tuple[float, float]:
    """``changes = a − b · values`` with b ≥ 0."""
    spread = values - values.mean()
    slope = float(spread @ changes / max(float(spread @ spread), 1e-12))
    back = max(0.0, -slope)
    return float(changes.mean() + back * values.mean()), back


def predict(
    responses: Sequence[Response], start: Place, schedule: NDArray[np.int64], dt: float
) -> tuple[Floats, Floats]:
    """Where C schedules lead.

    Args:
        responses: by the numbers in the schedule.
        start: before the first step.
        schedule: the choice latched in each of T steps, shape (C, T).
        dt: s per step of the schedule.

    Returns:
        x, y and heading after each step, shape (C, T, 3); and the last speed, shape (C,).
    """
    table = np.array([[one.pull, one.hold, one.drive, one.drag, one.slip] for one in responses])
    count, steps = schedule.shape
    places = np.empty((count, steps, 3))
    x, y = np.full(count, start.x), np.full(count, start.y)
    heading, speed = np.full(count, wrap_angle(start.heading)), np.full(count, start.speed)
    for step in range(steps):
        pull, hold, drive, drag, slip = table[schedule[:, step]].T
        heading = heading + (pull - hold * heading) * dt
        speed = np.maximum(0.0, speed + (drive - drag * speed) * dt)
        x = x + speed * np.cos(heading + slip) * dt
        y = y + speed * np.sin(heading + slip) * dt
        places[:, step] = np.stack([x, y, heading], axis=1)
    return places, speed
