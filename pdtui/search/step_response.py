"""How a controlled attribute answers when its target moves: rise time and overshoot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats

RISE_FROM, RISE_TO = 0.1, 0.9


@dataclass(frozen=True)
class StepResponse:
    """The answer to one step of the target.

    Attributes:
        rise: time from 10 to 90 % of the way from where the attribute was to the target, s; NaN where it did
            not come so far.
        overshoot: how far it went beyond the target, as a share of the target's step; 0 where it did not.
    """

    rise: float
    overshoot: float


@dataclass(frozen=True)
class StepResponseSummary:
    """The answers to many steps.

    Attributes:
        rise: mean rise time of the steps that have one, s; None where none has.
        unrisen: steps that did not come to 90 %.
        steps: of the target, in all.
        overshoot: mean over the steps; None where there is none.
    """

    rise: float | None
    unrisen: int
    steps: int
    overshoot: float | None

    @classmethod
    def of(cls, responses: Sequence[StepResponse]) -> StepResponseSummary:
        """Sum up."""
        risen = [one.rise for one in responses if np.isfinite(one.rise)]
        return cls(
            float(np.mean(risen)) if risen else None,
            len(responses) - len(risen),
            len(responses),
            float(np.mean([one.overshoot for one in responses])) if responses else None,
        )


def measure_step_response(
    start: float, values: Floats, target: float, step: float, dt: float
) -> StepResponse:
    """Measure one step as control engineering does (rise time from 10 to 90 %, peak beyond the target).

    Args:
        start: the attribute when the target moved.
        values: the attribute after each control step since, shape (T,), an angle without jumps; NaN from
            where the robot fell.
        target: where it is to go.
        step: by how much the target moved. A robot that lags behind has another way to go than that, so the
            rise is measured on its own way, the overshoot in shares of the step.
        dt: s per control step.
    """
    way = target - start
    path = np.array([start, *values])
    done = np.nan_to_num((path - start) * np.sign(way), nan=-np.inf)
    beyond = float(np.max(done)) - abs(way)
    times = [_first(done, share * abs(way)) for share in (RISE_FROM, RISE_TO)]
    return StepResponse((times[1] - times[0]) * dt, max(0.0, beyond) / abs(step))


def _first(path: Floats, level: float) -> float:
    """When a path first is at a level, in control steps, between two of them by a straight line."""
    reached = np.flatnonzero(path >= level)
    if not reached.size:
        return float("nan")
    after = int(reached[0])
    if after == 0:
        return 0.0
    low, high = path[after - 1], path[after]
    return after - 1 + float((level - low) / (high - low))
