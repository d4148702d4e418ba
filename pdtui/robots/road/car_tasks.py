"""What a driver makes a car do: brake, accelerate, and change to the lane on the left or the right."""

from __future__ import annotations

from functools import partial

import numpy as np

from pdtui.robots.robot_goals import RobotGoals
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict

# Control steps of 0.1 s: of a change of lanes, of braking, and of driving on after it, and of accelerating.
_LANE_STEPS, _BRAKE_STEPS, _DRIVE_ON_STEPS, _ACCELERATE_STEPS = 30, 20, 60, 30
# Control steps over which the usual speed, and heading and speed at the end, are averaged.
_USUAL_STEPS, _LAST_STEPS = 10, 5
# How far a change of lanes leads sideways (m), its middle, and the heading (rad) that counts as straight.
_LEAST_SHIFT, _MOST_SHIFT, _LANE_WIDTH, _STRAIGHT = 2.5, 4.5, 3.5, 0.1
# Heading from which on a search counts nothing more as astray, rad.
_ASTRAY = 0.5
# Speed that counts as standing (m/s), and shares of the usual speed that count as driving on and as faster.
_STANDING, _DRIVES_ON, _FASTER = 1.0, 0.5, 1.15


def judge_lane_change(trace: TaskRunTrace, sign: float) -> TaskVerdict:
    """Judge whether the car is one lane further after 3 s (left for sign 1) and drives straight again."""
    stays, left = trace.stays_up(_LANE_STEPS), trace["left distance"]
    shift = sign * float(trace.before("left distance")[-1] - left[-1]) if len(left) else 0.0
    heading = float(np.abs(trace["heading"][-_LAST_STEPS:]).mean()) if len(left) else _ASTRAY
    done = stays and _LEAST_SHIFT <= shift <= _MOST_SHIFT and heading <= _STRAIGHT
    missing = max(0.0, abs(shift - _LANE_WIDTH) - (_MOST_SHIFT - _LANE_WIDTH)) / _LANE_WIDTH
    astray = np.clip((heading - _STRAIGHT) / (_ASTRAY - _STRAIGHT), 0.0, 1.0)
    score = float(np.clip(1.0 - missing, -1.0, 1.0) - 0.5 * astray)
    if done:  # the nearer to the middle of the lane and the straighter, the better
        score += 0.5 - 0.3 * abs(shift - _LANE_WIDTH) - heading
    elif not stays:
        score = min(score, 0.5 * len(trace) / _LANE_STEPS)
    return TaskVerdict(done, score, {"shift (m)": shift, "heading at the end (rad)": heading})


def judge_brake(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether the car is slower than 1 m/s within 2 s, and drives on when the brake is let go."""
    usual = max(trace.mean_before("speed", _USUAL_STEPS), 1e-6)
    stays, speeds = trace.stays_up(_BRAKE_STEPS + _DRIVE_ON_STEPS), trace["speed"]
    slowest = float(speeds[:_BRAKE_STEPS].min(initial=usual))
    later = trace.mean("speed", slice(_BRAKE_STEPS + _DRIVE_ON_STEPS - _LAST_STEPS, None))
    stopped = float(np.clip((usual - slowest) / max(usual - _STANDING, 1e-6), 0.0, 1.0))
    resumed = float(np.clip(later / (_DRIVES_ON * usual), 0.0, 1.0))
    done = stays and slowest < _STANDING and later >= _DRIVES_ON * usual
    score = 0.6 * stopped + 0.4 * stopped * resumed + (0.1 if done else 0.0)
    score = score if stays else 0.3 * score
    return TaskVerdict(done, score, {"slowest (m/s)": slowest, "speed later (m/s)": later})


def judge_accelerate(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether the car is 15 % faster after 3 s than before."""
    usual = max(trace.mean_before("speed", _USUAL_STEPS), 1e-6)
    stays, speed = trace.stays_up(_ACCELERATE_STEPS), trace.mean("speed", slice(-_LAST_STEPS, None))
    gained = speed / usual
    score = (gained - 1.0) / (_FASTER - 1.0) if stays else 0.3 * len(trace) / _ACCELERATE_STEPS
    return TaskVerdict(stays and gained >= _FASTER, min(score, 3.0), {"of its own speed": gained})


def _pulse(
    name: str, key: str, says: str, wanted: str, steps: int, longest: int, judge: partial[TaskVerdict]
) -> Task:
    return Task(name, key, says, wanted, (40, 80), steps, judge, start="straight", period=longest)


CAR_TASKS: tuple[Task, ...] = (
    _pulse(
        "brake",
        "s",
        "brakes until it nearly stands, and then drives on",
        "slower than 1 m/s within 2 s, and 6 s later at half its speed again",
        _BRAKE_STEPS + _DRIVE_ON_STEPS,
        _BRAKE_STEPS,
        partial(judge_brake),
    ),
    _pulse(
        "accelerate",
        "w",
        "drives faster for 3 s",
        "15 % faster after 3 s",
        _ACCELERATE_STEPS,
        _ACCELERATE_STEPS,
        partial(judge_accelerate),
    ),
    _pulse(
        "lane left",
        "a",
        "changes to the lane on the left",
        "2.5 to 4.5 m to the left after 3 s, and straight again",
        _LANE_STEPS,
        20,
        partial(judge_lane_change, sign=1.0),
    ),
    _pulse(
        "lane right",
        "d",
        "changes to the lane on the right",
        "2.5 to 4.5 m to the right after 3 s, and straight again",
        _LANE_STEPS,
        20,
        partial(judge_lane_change, sign=-1.0),
    ),
)
CAR_GOALS = RobotGoals(
    tasks=tuple(task.name for task in CAR_TASKS),
    primitives={
        "speed": "pace",
        "lane offset": "sidestep",
        "left distance": "left edge",
        "heading": "heading",
        "yaw rate": "turn",
        "steering": "steering",
        "throttle": "throttle",
    },
)
"""A car's behaviors are pulses; held for longer, a change of lanes leads off the road."""
