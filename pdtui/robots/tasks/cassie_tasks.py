"""What the paper makes its Cassie do: crouch, walk on tiptoe, jump, flip backward."""

from __future__ import annotations

import math

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict, find_longest_run

_STEP = 0.02  # control step, s
# Control steps of each task.
_HOLD_STEPS, _JUMP_STEPS, _FLIP_STEPS = 250, 200, 200
# Largest and smallest height of the pelvis, as shares of the usual one, that count as crouching and tiptoe.
_CROUCH, _TIPTOE = 0.6, 1.1
# Control steps at the end in which the height and the speed are averaged, and those before the behavior.
_LAST_STEPS, _USUAL_STEPS = 100, 50
# Time for which both feet are off the ground in a jump (s), how high both are at once (m), and how far it
# turns in a flip (degrees).
_AIRBORNE, _FEET_HEIGHT, _FLIP_ANGLE = 0.25, 0.15, 300.0
# Share of the usual speed that counts as walking on.
_WALK_SHARE = 0.5


def _walks_on(trace: TaskRunTrace, steps: int) -> bool:
    usual = trace.mean_before("forward", _USUAL_STEPS)
    speed = trace.mean("forward", slice(-_LAST_STEPS, None))
    return trace.stays_up(steps) and speed >= _WALK_SHARE * usual


def _airborne(trace: TaskRunTrace) -> float:
    """Return the longest time in which no foot touches the ground, s."""
    return _STEP * find_longest_run((trace["left contact"] == 0.0) & (trace["right contact"] == 0.0))


def _judge_height(trace: TaskRunTrace, wanted: float) -> TaskVerdict:
    """Judge whether the pelvis is at a share of its usual height at the end, while the robot walks on."""
    share = trace.mean("height", slice(-_LAST_STEPS, None)) / trace.mean_before("height", _USUAL_STEPS)
    walks = _walks_on(trace, _HOLD_STEPS)
    reached = share <= wanted if wanted < 1.0 else share >= wanted
    progress = max(0.0, min(1.0, (share - 1.0) / (wanted - 1.0)))
    score = progress * (1.0 if walks else 0.0) + 0.3 * len(trace) / _HOLD_STEPS
    return TaskVerdict(reached and walks, score, {"share of its height": share, "walks on": float(walks)})


def judge_crouch(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it walks on with its pelvis at 0.6 of the usual height or less."""
    return _judge_height(trace, _CROUCH)


def judge_tiptoe(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it walks on with its pelvis at 1.1 of the usual height or more."""
    return _judge_height(trace, _TIPTOE)


def judge_cassie_jump(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether both feet leave the ground for 0.25 s and rise by 0.15 m, and the robot walks on."""
    feet: Floats = np.minimum(trace["left foot height"], trace["right foot height"])
    rise, airborne, walks = float(feet.max()), _airborne(trace), _walks_on(trace, _JUMP_STEPS)
    score = 0.4 * min(1.2, rise / _FEET_HEIGHT) + 0.3 * min(1.2, airborne / _AIRBORNE)
    score += 0.5 if walks else 0.2 * len(trace) / _JUMP_STEPS
    figures = {"both feet up (m)": rise, "in the air (s)": airborne, "walks on": float(walks)}
    return TaskVerdict(rise >= _FEET_HEIGHT and airborne >= _AIRBORNE and walks, score, figures)


def judge_back_flip(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it turns backward by 300° or more and stays up."""
    pitch = trace["pelvis pitch"]
    turned, lands = math.degrees(float(pitch[0] - pitch.min())), trace.stays_up(_FLIP_STEPS)
    score = min(1.2, turned / _FLIP_ANGLE) + (0.5 if lands else 0.1 * len(trace) / _FLIP_STEPS)
    figures = {"turned (degrees)": turned, "in the air (s)": _airborne(trace), "lands": float(lands)}
    return TaskVerdict(turned >= _FLIP_ANGLE and lands, score, figures)


_WALK = (100, 180)
CASSIE_TASKS = (
    Task(
        name="crouch",
        key="c",
        says="crouches while it walks on",
        wanted="pelvis at 0.6 of its usual height or less in the last 2 s of 5, walks on",
        walk=_WALK,
        steps=_HOLD_STEPS,
        judge=judge_crouch,
    ),
    Task(
        name="tiptoe",
        key="t",
        says="walks on tiptoe",
        wanted="pelvis at 1.1 of its usual height or more in the last 2 s of 5, walks on",
        walk=_WALK,
        steps=_HOLD_STEPS,
        judge=judge_tiptoe,
    ),
    Task(
        name="jump",
        key="i",
        says="jumps, lands and walks on",
        wanted="both feet off the ground for 0.25 s and 0.15 m up, then walks on",
        walk=_WALK,
        steps=_JUMP_STEPS,
        judge=judge_cassie_jump,
        period=40,
    ),
    Task(
        name="back flip",
        key="b",
        says="turns over backward in the air and lands",
        wanted="turns backward by 300° or more and stays up",
        walk=_WALK,
        steps=_FLIP_STEPS,
        judge=judge_back_flip,
        period=40,
    ),
)
