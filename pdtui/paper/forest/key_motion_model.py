"""How keys steer a robot: a model of how its heading, speed and course follow what is latched.

Every key pulls at the rate of turning, the speed and the drift (direction of motion less heading), and each
follows with a lag: a legged robot turns on for a while after the key is gone, and slides on in its old
direction when it turns. With the heading h against +x, ``rate' = (pull − hold · h − rate) / lag`` and
``h' = rate``; ``speed' = drive − drag · speed``; ``drift' = (slip − drift) / settle``. A policy that turns
on and on has no hold; one that sees its heading and comes back to it has.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.angles import wrap_angle
from pdtui.core.attributes import Floats

LOOKS_BACK = 16
"""Steps over which speed, course and rate of turning are seen: about one of its strides."""
_MOVING = 0.3


@dataclass(frozen=True)
class KeyMotionModel:
    """What the robot does while one key is latched.

    Attributes:
        pull, hold, lag: of the heading against +x, rad/s, 1/s and s.
        drive, drag: of the speed, m/s² and 1/s.
        slip, settle: of the direction of motion less heading, rad and s.
        falls: of the drives, for each press.
    """

    pull: float
    hold: float
    lag: float
    drive: float
    drag: float
    slip: float
    settle: float
    falls: float


@dataclass(frozen=True)
class ObservedDrive:
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
class RobotMotion:
    """Where a robot is and how it moves: x and y in m, heading in rad, speed in m/s, rate of turning in
    rad/s, direction of motion less heading in rad."""

    x: float
    y: float
    heading: float
    speed: float
    rate: float = 0.0
    drift: float = 0.0


def estimate_motion(places: Floats, dt: float) -> RobotMotion:
    """Where a robot is and how it moves, from its last places.

    Args:
        places: x, y and heading, the newest last, shape (N, 3) with N ≥ 2; at most `LOOKS_BACK` + 1 count.
        dt: s between them.
    """
    places = places[-LOOKS_BACK - 1 :]
    headings = np.unwrap(places[:, 2])
    times = (np.arange(len(places)) - len(places) + 1) * dt
    spread = times - times.mean()
    rate = float(spread @ headings / (spread @ spread))
    heading = float(headings.mean() - rate * times.mean())
    forth, aside = ((places[-1, :2] - places[0, :2]) / -times[0]).tolist()
    speed = math.hypot(forth, aside)
    drift = float(wrap_angle(math.atan2(aside, forth) - headings.mean())) if speed > _MOVING else 0.0
    x, y = places[-1, :2].tolist()
    return RobotMotion(x, y, float(wrap_angle(heading)), speed, rate, drift)


def predict_motion(
    responses: Sequence[KeyMotionModel], start: RobotMotion, schedule: NDArray[np.int64], dt: float
) -> tuple[Floats, RobotMotion]:
    """Where C schedules lead.

    Args:
        responses: by the numbers in the schedule.
        start: before the first step.
        schedule: the choice latched in each of T steps, shape (C, T).
        dt: s per step of the schedule.

    Returns:
        x, y and heading after each step, shape (C, T, 3); and where the first schedule ends.
    """
    table = np.array([astuple(one) for one in responses])[:, :7]
    count = len(schedule)
    latched = table[schedule.T]
    headings, rates = roll_heading(
        latched[..., :3], np.full(count, wrap_angle(start.heading)), np.full(count, start.rate), dt
    )
    speeds = roll_speed(latched[..., 3:5], np.full(count, start.speed), dt)
    drifts = roll_drift(latched[..., 5:7], np.full(count, start.drift), dt)
    x = start.x + np.cumsum(speeds * np.cos(headings + drifts) * dt, axis=0)
    y = start.y + np.cumsum(speeds * np.sin(headings + drifts) * dt, axis=0)
    last = (float(values[-1, 0]) for values in (x, y, headings, speeds, rates, drifts))
    return np.stack([x.T, y.T, headings.T], axis=2), RobotMotion(*last)


def roll_heading(latched: Floats, heading: Floats, rate: Floats, dt: float) -> tuple[Floats, Floats]:
    """Headings in rad and rates of turning in rad/s after each of T steps, shapes (T, C).

    Args:
        latched: pull, hold and lag in each step, shape (T, C, 3).
        heading, rate: before the first, shapes (C,).
        dt: s per step.
    """
    pull, hold, lag = np.moveaxis(latched, -1, 0)
    kept = np.exp(-dt / lag)
    headings, rates = np.empty(pull.shape), np.empty(pull.shape)
    for step in range(len(pull)):
        aim = pull[step] - hold[step] * heading
        rate = aim + kept[step] * (rate - aim)
        heading = heading + rate * dt
        headings[step], rates[step] = heading, rate
    return headings, rates


def roll_speed(latched: Floats, speed: Floats, dt: float) -> Floats:
    """Speeds in m/s after each of T steps, shape (T, C), from drive and drag in each, shape (T, C, 2)."""
    drive, drag = np.moveaxis(latched, -1, 0)
    speeds = np.empty(drive.shape)
    for step in range(len(drive)):
        speed = np.maximum(0.0, speed + (drive[step] - drag[step] * speed) * dt)
        speeds[step] = speed
    return speeds


def roll_drift(latched: Floats, drift: Floats, dt: float) -> Floats:
    """Drifts in rad after each of T steps, shape (T, C), from slip and settle in each, shape (T, C, 2)."""
    slip, settle = np.moveaxis(latched, -1, 0)
    kept = np.exp(-dt / settle)
    drifts = np.empty(slip.shape)
    for step in range(len(slip)):
        drift = slip[step] + kept[step] * (drift - slip[step])
        drifts[step] = drift
    return drifts
