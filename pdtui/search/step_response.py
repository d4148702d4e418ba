"""Rise time and overshoot of a controlled attribute when its target moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats

RISE_FROM, RISE_TO = 0.1, 0.9


@dataclass(frozen=True)
class StepResponse:
    """The response to one step of the target.

    Attributes:
        rise: time from 10 to 90 % of the way to the target, s; NaN if the attribute did not get that far.
        overshoot: peak beyond the target, as a share of the target's step; 0 if there is none.
    """

    rise: float
    overshoot: float


@dataclass(frozen=True)
class StepResponseSummary:
    """The responses to many steps.

    Attributes:
        rise: mean rise time of the responses that reached 90 %, s; None if none did.
        unrisen: number of responses that did not reach 90 %.
        steps: number of steps of the target.
        overshoot: mean overshoot; None if there are no steps.
    """

    rise: float | None
    unrisen: int
    steps: int
    overshoot: float | None

    @classmethod
    def of(cls, responses: Sequence[StepResponse]) -> StepResponseSummary:
        """Summarize responses."""
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
    """Measure the response to one step of the target.

    Args:
        start: the attribute when the target moved.
        values: the attribute after each control step since then, shape (T,), with angles unwrapped; NaN from
            a fall on.
        target: the new target.
        step: how far the target moved. A robot that lags behind has a different way to go, so the rise is
            measured on that way, but the overshoot relative to the step.
        dt: duration of a control step, s.
    """
    way = target - start
    path = np.array([start, *values])
    done = np.nan_to_num((path - start) * np.sign(way), nan=-np.inf)
    beyond = float(np.max(done)) - abs(way)
    times = [_first(done, share * abs(way)) for share in (RISE_FROM, RISE_TO)]
    return StepResponse((times[1] - times[0]) * dt, max(0.0, beyond) / abs(step))


def _first(path: Floats, level: float) -> float:
    """Return when a path first reaches a level, in control steps, interpolated linearly."""
    reached = np.flatnonzero(path >= level)
    if not reached.size:
        return float("nan")
    after = int(reached[0])
    if after == 0:
        return 0.0
    low, high = path[after - 1], path[after]
    return after - 1 + float((level - low) / (high - low))
