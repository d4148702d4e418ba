"""What the paper makes its Walker do: slow down, and hop on one leg."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdtui.robots.tasks.task import RunTrace, Task, TaskVerdict

_SLOWED = 0.25
_WITHIN, _UPRIGHT = 100, 200
_HOP_FROM, _HOP_STEPS, _HOP_SHARE, _FORWARD = 50, 150, 0.8, 0.3


def slows_down(trace: RunTrace) -> TaskVerdict:
    """Under a quarter of its speed from step 100 on, on average over 200 steps in which it stays up."""
    usual = float(trace.before("vx")[-100:].mean())
    whole = _WITHIN + _UPRIGHT
    lived = len(trace) / whole
    late = trace["vx"][_WITHIN:whole]
    left = float(np.abs(late).mean()) / usual if len(late) else 1.0
    up = not trace.fell and len(trace) >= whole
    # A fall is worth no more than the time before it.
    score = (1.0 - left) / (1.0 - _SLOWED) if up else 0.5 * lived * min(1.0, max(0.0, 1.0 - left))
    return TaskVerdict(up and left < _SLOWED, score, {"share of speed left": left, "steps up": len(trace)})


def hops(trace: RunTrace) -> TaskVerdict:
    """One foot stays off the ground for 80 % of 150 steps, in one stretch, while it moves forward.

    In one stretch, because each foot of a fast runner is off the ground for 80 % of the time, too.
    """
    end = _HOP_FROM + _HOP_STEPS
    window = slice(_HOP_FROM, end)
    off = [trace[f"{side} foot clearance"][window] > 0.0 for side in ("right", "left")]
    speed = float(trace["vx"][window].mean()) if len(trace) > _HOP_FROM else 0.0
    stretch = max(_longest(foot) for foot in off) / _HOP_STEPS
    up = not trace.fell and len(trace) >= end
    done = up and stretch >= _HOP_SHARE and speed > _FORWARD
    score = stretch / _HOP_SHARE
    if not up:
        score = 0.5 * score * len(trace) / end
    elif speed <= _FORWARD:
        score *= 0.6
    figures = {
        "longest stretch with one foot up (of 1)": stretch,
        "share of steps with one foot up": max(float(foot.sum()) for foot in off) / _HOP_STEPS,
        "vx (m/s)": speed,
    }
    return TaskVerdict(done, score, figures)


def _longest(flags: NDArray[np.bool_]) -> int:
    """Length of the longest run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


TASKS = (
    Task(
        name="slow down",
        robot="walker",
        key="x",
        says="slows down to a stand and stays up",
        wanted="under 25 % of its speed after 100 steps, up for 200 more",
        walk=(200, 300),
        steps=_WITHIN + _UPRIGHT,
        judge=slows_down,
    ),
    Task(
        name="hop",
        robot="walker",
        key="h",
        says="hops forward on one leg",
        wanted="one foot off the ground for 80 % of 150 steps in one stretch, moving forward",
        walk=(200, 300),
        steps=_HOP_FROM + _HOP_STEPS,
        judge=hops,
    ),
)
