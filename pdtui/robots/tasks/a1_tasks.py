"""What the paper makes its A1 do: turn left and right, stop, and go forward."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict

_STEP = 0.016  # control step, s
# Control steps of a run, and of it those over which turning and speed are averaged, and the late ones.
_STEPS = 150
_WINDOW, _LATE = slice(25, _STEPS), slice(75, _STEPS)
# Control steps before the behavior over which the usual speed is averaged.
_USUAL_STEPS = 50
# Slowest yaw rate that counts as a turn (rad/s), the multiple of it up to which faster scores more, so that
# somebody can steer by it, and the slowest speed of a turn (m/s).
_TURN_RATE, _MAX_TURN_SCORE, _TURN_SPEED = 0.15, 6.0, 0.5
# Fastest mean speed that counts as standing (m/s), and most touchdowns of all feet, a second.
_STAND_SPEED, _STAND_TOUCHDOWNS = 0.1, 2.0
# Speed from which on a search counts nothing more as slowing down, m/s.
_SLOW_SPEED = 0.3
_CONTACTS = tuple(f"{leg} contact" for leg in ("front right", "front left", "rear right", "rear left"))
# Share of the usual speed that counts as faster.
_FASTER = 1.1


def judge_turn(trace: TaskRunTrace, sign: float) -> TaskVerdict:
    """Judge whether it turns by 0.15 rad/s on average (left for sign 1, right for −1) while it walks."""
    yaw, walks = trace["yaw"][_WINDOW], trace.mean("speed", _WINDOW)
    rate = float(yaw[-1] - yaw[0]) / (_STEP * (len(yaw) - 1)) if len(yaw) > 1 else 0.0
    score = float(np.clip(sign * rate / _TURN_RATE, -1.0, _MAX_TURN_SCORE)) * min(1.0, walks / _TURN_SPEED)
    up = trace.stays_up(_STEPS)
    if not up:
        score = min(score, 0.5 * len(trace) / _STEPS)
    done = up and sign * rate >= _TURN_RATE and walks >= _TURN_SPEED
    return TaskVerdict(done, score, {"yaw rate (rad/s)": rate, "speed (m/s)": walks})


def judge_stop(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it stands from 1.2 s on: under 0.1 m/s on average, feet still, and up for 2.4 s."""
    usual = trace.mean_before("speed", _USUAL_STEPS)
    left, up = trace.mean("speed", _LATE, usual), trace.stays_up(_STEPS)
    gone = float(np.clip((usual - left) / max(usual - _SLOW_SPEED, 1e-6), 0.0, 1.2))
    score = gone if up else 0.5 * gone * len(trace) / _STEPS
    late = np.stack([trace[name][_LATE] for name in _CONTACTS])
    touchdowns = float((np.diff(late, axis=1) > 0.0).sum()) / (_STEP * max(1, late.shape[1]))
    steepest = float(trace["pitch"].max()) if len(trace) else 0.0
    figures = {"speed (m/s)": left, "touchdowns (1/s)": touchdowns, "steepest pitch (rad)": steepest}
    stands = up and left < _STAND_SPEED and touchdowns <= _STAND_TOUCHDOWNS
    return TaskVerdict(stands, score, figures)


def judge_speed_up(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it moves along x a tenth faster than by itself."""
    speed, up = trace.mean("vx", _WINDOW), trace.stays_up(_STEPS)
    gained = speed / max(trace.mean_before("vx", _USUAL_STEPS), 1e-6)
    score = gained / _FASTER if up else 0.5 * min(1.0, gained) * len(trace) / _STEPS
    return TaskVerdict(up and gained >= _FASTER, score, {"vx (m/s)": speed, "of its own speed": gained})


def _task(name: str, key: str, says: str, wanted: str, judge: Callable[[TaskRunTrace], TaskVerdict]) -> Task:
    return Task(name, key, says, wanted, (90, 150), _STEPS, judge, start="rough")


A1_TASKS: tuple[Task, ...] = (
    _task(
        "left",
        "a",
        "turns left while it walks",
        "0.15 rad/s to the left, on its feet",
        partial(judge_turn, sign=1.0),
    ),
    _task(
        "right",
        "d",
        "turns right while it walks",
        "0.15 rad/s to the right, on its feet",
        partial(judge_turn, sign=-1.0),
    ),
    _task("stop", "s", "stops and stands", "under 0.1 m/s after 1.2 s, feet still, up", judge_stop),
    _task("forward", "w", "walks on faster", "a tenth faster than by itself", judge_speed_up),
)
