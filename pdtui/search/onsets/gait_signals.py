"""Finds what oscillates with the gait, so that a behavior can wait for a phase of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.stimulation.interventions.gait_clock import GaitClock, GaitMark

_LEVELS = (0.25, 0.5, 0.75)
"""Quantiles of a signal whose crossings are looked at."""
_LEAST_CYCLES = 5
"""Cycles of a walk from which the regularity of a signal can be told."""
_MOST_IRREGULAR = 0.25
"""Largest standard deviation of the lengths of a regular signal's cycles, as a share of their mean."""
_SHORTEST_CYCLE, _LONGEST_CYCLE = 0.2, 2.0
"""Lengths of a cycle of a gait, s. Noise has cycles, too, which are hardly longer than the least spacing."""
_APART = 0.6
"""Least time between two moments of a mark, as a share of the cycle, so that ripples count once."""


def find_gait_marks(
    walks: Sequence[Floats], attributes: Sequence[Attribute], dt: float, count: int
) -> list[tuple[GaitMark, float]]:
    """Return moments that come once per cycle of the gait, the most regular first.

    A moment is when an attribute rises through a level that it is below for a quarter, half or three quarters
    of the time, whichever is most regular. What does not oscillate, such as the position along the way,
    crosses a level too seldom to be regular.

    Args:
        walks: The attributes at each control step of some walks, shape (T, J) each.
        attributes: The robot's attributes.
        dt: Duration of a control step, s.
        count: Most marks to return.

    Returns:
        The marks, each with the mean length of a cycle, s.
    """
    found = []
    for column, attribute in enumerate(attributes):
        values = [walk[:, column] for walk in walks]
        looked_at = [] if attribute.wraps else np.quantile(np.concatenate(values), _LEVELS).tolist()
        regular = [one for level in looked_at if (one := _find_mark(values, attribute.name, level, dt))]
        found += sorted(regular, key=lambda one: one[0])[:1]
    found.sort(key=lambda one: one[0])
    return [(mark, length) for _, mark, length in found[:count]]


def _find_mark(
    values: Sequence[Floats], signal: str, level: float, dt: float
) -> tuple[float, GaitMark, float] | None:
    """Return how irregular a signal is at a level, the mark and the length of its cycle, if it is regular."""
    level, apart = float(f"{level:.3g}"), _SHORTEST_CYCLE / 2
    # The second look counts a moment once per cycle, even where the signal ripples.
    for _ in range(2):
        mark = GaitMark(signal, "up", level, round(apart, 3))
        cycles = _cycle_lengths(values, mark, dt)
        if len(cycles) < _LEAST_CYCLES:
            return None
        apart = float(_APART * np.quantile(cycles, 0.75))
    length = float(cycles.mean())
    irregular = float(cycles.std()) / length
    gait = irregular <= _MOST_IRREGULAR and _SHORTEST_CYCLE <= length <= _LONGEST_CYCLE
    return (irregular, mark, length) if gait else None


def _cycle_lengths(values: Sequence[Floats], mark: GaitMark, dt: float) -> Floats:
    """Return the times between moments of a mark, s, as a clock counts them."""
    lengths = []
    for series in values:
        clock = GaitClock(mark, dt)
        for value in series.tolist():
            clock.update(value)
            if clock.control_steps_since == 0 and clock.period is not None:
                lengths.append(clock.period * dt)
    return np.array(lengths)
