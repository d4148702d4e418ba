"""The search space of a controller's gains: a box of four numbers, and the gains that a point stands for.

The numbers are free of scale, so that one box serves headings, speeds and heights: the limit as a multiple of
the map's, the error at which the proportional part alone reaches the limit as a multiple of the targets'
steps, and the integral and derivative times ``Ti = kp / ki`` and ``Td = kd / kp``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from pdtui.core.attributes import Floats
from pdtui.search.stimulation_sampler import round_to_three_digits
from pdtui.stimulation.stimulation_map import PidGains

LIMIT, SATURATION, INTEGRAL, DERIVATIVE = (0.25, 4.0), (0.05, 5.0), (0.3, 30.0), (0.01, 1.0)
"""Bounds of the box: multiples of the map's limit, multiples of the step, s, s."""
_WITHOUT = 0.5
"""Share of the points without an integral part, and share of those without a derivative part."""


def sample_gain_points(count: int, seed: int) -> Floats:
    """Return points of a Latin hypercube in the box, as `gains_from_point` takes them, shape (count, 4)."""
    drawn = qmc.LatinHypercube(6, rng=np.random.default_rng(seed)).random(count)
    lows, highs = np.log(np.array([LIMIT, SATURATION, INTEGRAL, DERIVATIVE])).T
    points: Floats = lows + drawn[:, :4] * (highs - lows)
    points[:, 2:][drawn[:, 4:] < _WITHOUT] = np.nan
    return points


def gains_from_point(point: Sequence[float] | Floats, old: PidGains, step: float) -> PidGains:
    """Return the controller that a point stands for, with gains of three significant digits.

    Args:
        point: logarithms of the four numbers; NaN as the third or fourth leaves that part out.
        old: the map's controller, from which the limit is scaled and everything but the gains is taken.
        step: mean step of the targets, in the attribute's unit.
    """
    limit = old.limit * math.exp(point[0])
    kp = math.copysign(limit / (step * math.exp(point[1])), old.kp)
    ki = 0.0 if math.isnan(point[2]) else kp / math.exp(point[2])
    kd = 0.0 if math.isnan(point[3]) else kp * math.exp(point[3])
    kp, ki, kd, limit = map(round_to_three_digits, (kp, ki, kd, limit))
    return replace(old, kp=kp, ki=ki, kd=kd, limit=limit)


def point_from_gains(pid: PidGains, old: PidGains, step: float) -> Floats | None:
    """Invert `gains_from_point` up to rounding; return None for a controller without a proportional part."""
    if pid.kp == 0.0:
        return None
    ti = pid.kp / pid.ki if pid.ki else 0.0
    td = pid.kd / pid.kp
    parts = (pid.limit / old.limit, pid.limit / (abs(pid.kp) * step), ti, td)
    return np.array([math.log(part) if part > 0 else math.nan for part in parts])
