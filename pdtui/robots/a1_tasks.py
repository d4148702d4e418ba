"""What the paper makes its A1 do: turn left and right, stop, and go forward."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pdtui.robots.task import RunTrace, Task, TaskVerdict

_STEP = 0.016
_FROM, _STEPS = 25, 150
_TURN, _SPRY, _MOVING = 0.15, 6.0, 0.5
_STAND, _STILL_FROM = 0.3, 75
_FASTER = 1.1


def _up(trace: RunTrace) -> bool:
    return not trace.fell and len(trace) >= _STEPS


def _turns(trace: RunTrace, sign: float) -> TaskVerdict:
    """At least 0.15 rad/s on average that way, on its feet and walking."""
    window = slice(_FROM, _STEPS)
    yaw, speed = trace["yaw"][window], trace["speed"][window]
    rate = float(yaw[-1] - yaw[0]) / (_STEP * (len(yaw) - 1)) if len(yaw) > 1 else 0.0
    walks = float(speed.mean()) if len(speed) else 0.0
    up = _up(trace)
    # Four times as fast is better still, where somebody has to steer by it.
    score = float(np.clip(sign * rate / _TURN, -1.0, _SPRY)) * min(1.0, walks / _MOVING)
    if not up:
        score = min(score, 0.5 * len(trace) / _STEPS)
    done = up and sign * rate >= _TURN and walks >= _MOVING
    return TaskVerdict(done, score, {"yaw rate (rad/s)": rate, "speed (m/s)": walks})


def turns_left(trace: RunTrace) -> TaskVerdict:
    """See `_turns`."""
    return _turns(trace, 1.0)


def turns_right(trace: RunTrace) -> TaskVerdict:
    """See `_turns`."""
    return _turns(trace, -1.0)


def stops(trace: RunTrace) -> TaskVerdict:
    """Under 0.3 m/s from 1.2 s on, on average, and on its feet for 2.4 s."""
    usual = float(trace.before("speed")[-50:].mean())
    late = trace["speed"][_STILL_FROM:_STEPS]
    left = float(late.mean()) if len(late) else usual
    up = _up(trace)
    gone = float(np.clip((usual - left) / max(usual - _STAND, 1e-6), 0.0, 1.2))
    score = gone if up else 0.5 * gone * len(trace) / _STEPS
    steepest = float(trace["pitch"].max()) if len(trace) else 0.0
    return TaskVerdict(up and left < _STAND, score, {"speed (m/s)": left, "steepest pitch (rad)": steepest})


def speeds_up(trace: RunTrace) -> TaskVerdict:
    """Along x by a tenth faster than by itself."""
    usual = float(trace.before("vx")[-50:].mean())
    vx = trace["vx"][_FROM:_STEPS]
    speed = float(vx.mean()) if len(vx) else 0.0
    up, gained = _up(trace), speed / max(usual, 1e-6)
    score = gained / _FASTER if up else 0.5 * min(1.0, gained) * len(trace) / _STEPS
    return TaskVerdict(up and gained >= _FASTER, score, {"vx (m/s)": speed, "of its own speed": gained})


def _task(name: str, key: str, says: str, wanted: str, judge: Callable[[RunTrace], TaskVerdict]) -> Task:
    return Task(name, key, says, wanted, (90, 150), _STEPS, judge, start="rough")


A1_TASKS: tuple[Task, ...] = (
    _task("left", "a", "turns left while it walks", "0.15 rad/s to the left, on its feet", turns_left),
    _task("right", "d", "turns right while it walks", "0.15 rad/s to the right, on its feet", turns_right),
    _task("stop", "s", "stops and stands", "under 0.3 m/s after 1.2 s, on its feet", stops),
    _task("forward", "w", "walks on faster", "a tenth faster than by itself", speeds_up),
)
