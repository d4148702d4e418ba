"""What the paper makes its BipedalWalker do: jump, flip forward, stand up from a split."""

from __future__ import annotations

import math

import numpy as np

from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict, find_longest_run

_STEP = 0.02  # control step, s
# Control steps of each task.
_JUMP_STEPS, _FLIP_STEPS, _STAND_STEPS = 200, 200, 300
# Rise of the hull that counts as a jump (m), and turn that counts as a flip (degrees).
_JUMP_HEIGHT, _FLIP_ANGLE = 0.5, 300.0
# Share of the usual speed that counts as walking again, and the speed (m/s) of a robot that did not walk yet.
_WALK_SHARE, _WALK_SPEED = 0.5, 5.0
# Control steps in a row with both feet off the ground that count as being in the air: 0.3 s, for the shipped
# policy's usual gait has both feet off the ground for 0.25 s at once.
_AIRBORNE_STEPS = 15
# Control steps over which the speed at the end, and the usual height and speed, are averaged.
_LAST_STEPS, _USUAL_STEPS = 60, 50


def _walks(trace: TaskRunTrace, usual: float, steps: int) -> tuple[bool, float]:
    """Return whether it is up at the end and walks at half its speed, and the speed there."""
    speed = trace.mean("vx", slice(-_LAST_STEPS, None))
    return trace.stays_up(steps) and speed >= _WALK_SHARE * usual, speed


def _count_airborne(trace: TaskRunTrace) -> int:
    """Return the longest stretch of control steps in which no foot touches the ground."""
    in_air = (trace["foot 1 contact"] == 0.0) & (trace["foot 2 contact"] == 0.0)
    return find_longest_run(in_air)


def judge_jump(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether both feet leave the ground, the hull rises by half a meter, and the robot walks on."""
    rise = float(trace["height"].max()) - trace.mean_before("height", _USUAL_STEPS)
    airborne = _count_airborne(trace)
    walks, speed = _walks(trace, trace.mean_before("vx", _USUAL_STEPS), _JUMP_STEPS)
    score = 0.5 * min(1.2, rise / _JUMP_HEIGHT) + (0.6 if walks else 0.25 * len(trace) / _JUMP_STEPS)
    figures = {
        "rise (m)": rise,
        "in the air (s)": airborne * _STEP,
        "walks on": float(walks),
        "vx at the end (m/s)": speed,
    }
    done = rise >= _JUMP_HEIGHT and airborne >= _AIRBORNE_STEPS and walks
    return TaskVerdict(done, score, figures)


def judge_flip(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it turns forward in the air by 300° or more; whether it lands is another figure."""
    pitch, airborne = trace["pitch"], _count_airborne(trace)
    turned = math.degrees(float(np.max(pitch) - pitch[0]))
    walks, _ = _walks(trace, trace.mean_before("vx", _USUAL_STEPS), _FLIP_STEPS)
    lands = turned >= _FLIP_ANGLE and trace.stays_up(_FLIP_STEPS)
    score = min(1.2, turned / _FLIP_ANGLE) + (1.0 if lands and walks else 0.2 * len(trace) / _FLIP_STEPS)
    figures = {
        "turned (degrees)": turned,
        "in the air (s)": airborne * _STEP,
        "lands": float(lands),
        "walks on": float(lands and walks),
    }
    return TaskVerdict(turned >= _FLIP_ANGLE and airborne >= _AIRBORNE_STEPS, score, figures)


def judge_stand_up(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it walks again by the end."""
    walks, speed = _walks(trace, _WALK_SPEED, _STAND_STEPS)
    share = max(0.0, min(1.0, speed / (_WALK_SHARE * _WALK_SPEED)))
    score = 0.5 * len(trace) / _STAND_STEPS + 0.5 * share + float(walks)
    return TaskVerdict(walks, score, {"vx at the end (m/s)": speed, "steps up": float(len(trace))})


BIPEDAL_WALKER_TASKS = (
    Task(
        name="jump",
        key="i",
        says="jumps, lands and walks on",
        wanted="both feet up for 0.3 s, hull 0.5 m over its usual height, then walks on",
        walk=(60, 120),
        steps=_JUMP_STEPS,
        judge=judge_jump,
        period=50,
    ),
    Task(
        name="front flip",
        key="f",
        says="turns over forward in the air",
        wanted="turns forward by 300° or more, both feet up for 0.3 s",
        walk=(60, 120),
        steps=_FLIP_STEPS,
        judge=judge_flip,
        period=80,
    ),
    Task(
        name="stand up",
        key="u",
        says="gets up from a split and walks again",
        wanted="walks at half its speed at the end of 300 steps",
        walk=(0, 0),
        steps=_STAND_STEPS,
        judge=judge_stand_up,
        start="split",
        period=100,
        follows="front flip",
    ),
)
