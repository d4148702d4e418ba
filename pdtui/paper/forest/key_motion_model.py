"""A model of how a robot moves while a key is latched.

Each key acts on the yaw rate, the speed and the drift (direction of motion minus heading), which follow with
a lag: a legged robot keeps turning for a while after the key is released, and slides on in its old direction
when it turns. With the heading h relative to +x, ``rate' = (pull − hold · h − rate) / lag`` and
``h' = rate``; ``speed' = drive − drag · speed``; ``drift' = (slip − drift) / settle``. The hold is zero for a
policy that keeps turning, and positive for one that senses its heading and returns to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.core.outcome import Outcome

STEPS_OBSERVED = 16
"""Control steps over which the motion is estimated: about one stride."""
_MOVING = 0.3
"""Slowest speed at which the direction of motion is meaningful, m/s."""


@dataclass(frozen=True)
class KeyMotionModel:
    """How the robot moves while one key is latched; the module gives the equations.

    Attributes:
        pull, hold, lag: parameters of the heading relative to +x, rad/s, 1/s and s.
        drive, drag: parameters of the speed, m/s² and 1/s.
        slip, settle: parameters of the drift, rad and s.
        falls: falls per press of the key.
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
    """What an observer sees of a drive of S control steps.

    Attributes:
        places: x and y in m and heading in rad before each step and after the last, shape (S + 1, 3).
        choices: index of the key that was latched in each step, shape (S,).
        outcome: how the episode ended; None if it did not.
    """

    places: Floats
    choices: NDArray[np.int64]
    outcome: Outcome | None


@dataclass(frozen=True)
class RobotMotion:
    """Where a robot is and how it moves.

    Attributes:
        x, y: position, m.
        heading: rad.
        speed: m/s.
        rate: yaw rate, rad/s.
        drift: direction of motion minus heading, rad.
    """

    x: float
    y: float
    heading: float
    speed: float
    rate: float = 0.0
    drift: float = 0.0


def estimate_motion(places: Floats, dt: float) -> RobotMotion:
    """Estimate a robot's motion from its last places, `dt` s apart.

    They are x, y and heading, the newest last, shape (N, 3), N ≥ 2; the last `STEPS_OBSERVED` + 1 count.
    """
    places = places[-STEPS_OBSERVED - 1 :]
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
    key_models: Sequence[KeyMotionModel], start: RobotMotion, schedule: NDArray[np.int64], dt: float
) -> tuple[Floats, RobotMotion]:
    """Predict where C schedules of keys lead.

    Args:
        start: motion before the first step.
        schedule: index of the key latched in each of T steps of `dt` s, shape (C, T).

    Returns:
        x, y and heading after each step, shape (C, T, 3), and the motion at the end of the first schedule.
    """
    table = np.array([astuple(one) for one in key_models])[:, :7]
    count = len(schedule)
    latched = table[schedule.T]
    headings, rates = integrate_heading(
        latched[..., :3], np.full(count, wrap_angle(start.heading)), np.full(count, start.rate), dt
    )
    speeds = integrate_speed(latched[..., 3:5], np.full(count, start.speed), dt)
    drifts = integrate_drift(latched[..., 5:7], np.full(count, start.drift), dt)
    x = start.x + np.cumsum(speeds * np.cos(headings + drifts) * dt, axis=0)
    y = start.y + np.cumsum(speeds * np.sin(headings + drifts) * dt, axis=0)
    last = (float(values[-1, 0]) for values in (x, y, headings, speeds, rates, drifts))
    return np.stack([x.T, y.T, headings.T], axis=2), RobotMotion(*last)


def integrate_heading(latched: Floats, heading: Floats, rate: Floats, dt: float) -> tuple[Floats, Floats]:
    """Return headings in rad and yaw rates in rad/s after each of T steps, shapes (T, C).

    Pull, hold and lag in each step have the shape (T, C, 3), heading and rate before the first step (C,).
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


def integrate_speed(latched: Floats, speed: Floats, dt: float) -> Floats:
    """Return speeds in m/s after each of T steps, shape (T, C), from drive and drag, shape (T, C, 2)."""
    drive, drag = np.moveaxis(latched, -1, 0)
    speeds = np.empty(drive.shape)
    for step in range(len(drive)):
        speed = np.maximum(0.0, speed + (drive[step] - drag[step] * speed) * dt)
        speeds[step] = speed
    return speeds


def integrate_drift(latched: Floats, drift: Floats, dt: float) -> Floats:
    """Return drifts in rad after each of T steps, shape (T, C), from slip and settle, shape (T, C, 2)."""
    slip, settle = np.moveaxis(latched, -1, 0)
    kept = np.exp(-dt / settle)
    drifts = np.empty(slip.shape)
    for step in range(len(slip)):
        drift = slip[step] + kept[step] * (drift - slip[step])
        drifts[step] = drift
    return drifts
