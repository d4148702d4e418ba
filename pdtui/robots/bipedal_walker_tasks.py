"""What the paper makes its BipedalWalker do: jump, flip forward, stand up from a split."""

from __future__ import annotations

import math

import numpy as np

from pdtui.robots.task import RunTrace, Task, TaskVerdict

_RISE = 0.5
_FLIP = 300.0
_WALKS = 0.5
_LAST = 60
_SPEED = 5.0
"""m/s; walking again is half of what it usually walks, or of this where it did not walk yet."""


def _walks(trace: RunTrace, usual: float, steps: int) -> tuple[bool, float]:
    """Whether it is up at the end and walks at half its speed, and the speed there."""
    late = trace["vx"][-_LAST:]
    speed = float(late.mean()) if len(late) else 0.0
    return not trace.fell and len(trace) >= steps and speed >= _WALKS * usual, speed


def jumps(trace: RunTrace) -> TaskVerdict:
    """The hull rises half a metre over its usual height; then it lands and walks on."""
    height = float(trace.before("height")[-50:].mean())
    usual = float(trace.before("vx")[-50:].mean())
    rise = float(trace["height"].max()) - height
    walks, speed = _walks(trace, usual, _JUMP_STEPS)
    score = 0.5 * min(1.2, rise / _RISE) + (0.6 if walks else 0.25 * len(trace) / _JUMP_STEPS)
    figures = {"rise (m)": rise, "walks on": float(walks), "vx at the end (m/s)": speed}
    return TaskVerdict(rise >= _RISE and walks, score, figures)


def flips(trace: RunTrace) -> TaskVerdict:
    """It turns forward by 300° and more; whether it lands is counted beside that."""
    pitch = trace["pitch"]
    turned = math.degrees(float(np.max(pitch) - pitch[0]))
    usual = float(trace.before("vx")[-50:].mean())
    walks, _ = _walks(trace, usual, _FLIP_STEPS)
    lands = turned >= _FLIP and not trace.fell and len(trace) >= _FLIP_STEPS
    score = min(1.2, turned / _FLIP) + (1.0 if lands and walks else 0.2 * len(trace) / _FLIP_STEPS)
    figures = {"turned (degrees)": turned, "lands": float(lands), "walks on": float(lands and walks)}
    return TaskVerdict(turned >= _FLIP, score, figures)


def stands_up(trace: RunTrace) -> TaskVerdict:
    """It walks again by the end."""
    walks, speed = _walks(trace, _SPEED, _STAND_STEPS)
    score = 0.5 * len(trace) / _STAND_STEPS + 0.5 * max(0.0, min(1.0, speed / (_WALKS * _SPEED)))
    return TaskVerdict(
        walks, score + float(walks), {"vx at the end (m/s)": speed, "steps up": float(len(trace))}
    )


_JUMP_STEPS, _FLIP_STEPS, _STAND_STEPS = 200, 200, 300
BIPEDAL_WALKER_TASKS = (
    Task(
        name="jump",
        key="j",
        says="jumps, lands and walks on",
        wanted="hull 0.5 m over its usual height, then walks on",
        walk=(60, 120),
        steps=_JUMP_STEPS,
        judge=jumps,
        period=50,
    ),
    Task(
        name="front flip",
        key="f",
        says="turns over forward in the air",
        wanted="turns forward by 300° or more",
        walk=(60, 120),
        steps=_FLIP_STEPS,
        judge=flips,
        period=80,
    ),
    Task(
        name="stand up",
        key="u",
        says="gets up from a split and walks again",
        wanted="walks at half its speed at the end of 300 steps",
        walk=(0, 0),
        steps=_STAND_STEPS,
        judge=stands_up,
        start="split",
        period=100,
    ),
)
