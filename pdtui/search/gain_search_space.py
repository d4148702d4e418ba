"""Where a search for a controller's gains looks: points in a box, and the gains that they stand for.

A controller is scale-free in these four numbers, so that one box serves headings, speeds and heights: its
limit as a multiple of the map's, the error at which the proportional part alone reaches the limit as a
multiple of the targets' steps, and the integral and derivative times, ``Ti = kp / ki`` and ``Td = kd / kp``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from pdtui.core.attributes import Floats
from pdtui.stimulation.stimulation_map import PidGains

LIMIT, SATURATION, INTEGRAL, DERIVATIVE = (0.25, 4.0), (0.05, 5.0), (0.3, 30.0), (0.01, 1.0)
"""Ends of the box: multiples of the limit, multiples of the step, s, s."""
_WITHOUT = 0.5
"""Share of the first points whose controllers have no integral part; and of those that have no derivative."""


def sample_gain_points(count: int, seed: int) -> Floats:
    """Points spread evenly over the box by a Latin hypercube, shape (count, 4).

    A point holds the logarithms that `gains_from_point` describes; NaN as its third or fourth leaves the part
    out.
    """
    drawn = qmc.LatinHypercube(6, rng=np.random.default_rng(seed)).random(count)
    lows, highs = np.log(np.array([LIMIT, SATURATION, INTEGRAL, DERIVATIVE])).T
    points: Floats = lows + drawn[:, :4] * (highs - lows)
    points[:, 2:][drawn[:, 4:] < _WITHOUT] = np.nan
    return points


def gains_from_point(point: Sequence[float] | Floats, old: PidGains, step: float) -> PidGains:
    """The controller that a point stands for, with the three digits that a map gets.

    Args:
        point: logarithms of the limit over `old`'s, of the error at which the output is at the limit over
            `step`, of Ti and of Td; NaN for none.
        old: keeps attribute and arrow key, and the sign of its proportional gain.
        step: of the targets, in the attribute's unit.
    """
    limit = old.limit * math.exp(point[0])
    kp = math.copysign(limit / (step * math.exp(point[1])), old.kp)
    ki = 0.0 if math.isnan(point[2]) else kp / math.exp(point[2])
    kd = 0.0 if math.isnan(point[3]) else kp * math.exp(point[3])
    return replace(old, kp=_digits(kp), ki=_digits(ki), kd=_digits(kd), limit=_digits(limit))


def point_from_gains(pid: PidGains, old: PidGains, step: float) -> Floats | None:
    """Inverse of `gains_from_point`, but for rounding; None for a controller without a proportional part."""
    if pid.kp == 0.0:
        return None
    ti = pid.kp / pid.ki if pid.ki else 0.0
    td = pid.kd / pid.kp
    parts = (pid.limit / old.limit, pid.limit / (abs(pid.kp) * step), ti, td)
    return np.array([math.log(part) if part > 0 else math.nan for part in parts])


def _digits(value: float) -> float:
    return float(f"{value:.3g}")
