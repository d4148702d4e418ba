"""Rise time and overshoot against the formulas of a second-order system."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from pdtui.search.gains.step_response import StepResponse, StepResponseSummary, measure_step_response

DT = 0.02


def _second_order(zeta: float, omega: float, t: float) -> float:
    """Unit step response of ω² / (s² + 2ζωs + ω²), 0 < ζ < 1."""
    damped = omega * math.sqrt(1 - zeta**2)
    decay = math.exp(-zeta * omega * t)
    return 1 - decay * (math.cos(damped * t) + zeta * omega / damped * math.sin(damped * t))


@pytest.mark.parametrize(("zeta", "omega"), [(0.3, 3.0), (0.5, 2.0), (0.8, 5.0)])
@pytest.mark.parametrize(("start", "target"), [(0.0, 0.9), (0.4, -0.5)])
def test_a_second_order_response(zeta: float, omega: float, start: float, target: float) -> None:
    values = np.array([_second_order(zeta, omega, DT * step) for step in range(1, 400)])
    found = measure_step_response(start, start + (target - start) * values, target, target - start, DT)
    peak = math.pi / (omega * math.sqrt(1 - zeta**2))
    ten, ninety = (
        brentq(lambda t, level=level: _second_order(zeta, omega, t) - level, 0.0, peak)
        for level in (0.1, 0.9)
    )
    assert found.rise == pytest.approx(ninety - ten, abs=0.002)
    assert found.overshoot == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)), abs=0.002)


def test_a_step_that_is_not_reached_has_no_rise_time() -> None:
    slow = measure_step_response(0.0, np.linspace(0.0, 0.8, 50), 1.0, 1.0, DT)
    fell = measure_step_response(0.0, np.array([0.5, np.nan, np.nan]), 1.0, 1.0, DT)
    assert math.isnan(slow.rise)
    assert math.isnan(fell.rise)
    assert slow.overshoot == fell.overshoot == 0.0
    both = StepResponseSummary.of([slow, StepResponse(0.6, 0.3)])
    assert both == StepResponseSummary(0.6, 1, 2, 0.15)
    assert StepResponseSummary.of([slow]).rise is None


def test_a_robot_that_lags_is_measured_on_its_own_way() -> None:
    """It was at 0.5 when the target moved from 1.2 to 0.9: it has 0.4 to go up, and passes by 0.03."""
    values = np.array([0.54, 0.7, 0.86, 0.93, 0.9])
    found = measure_step_response(0.5, values, 0.9, -0.3, DT)
    assert found.rise == pytest.approx(2 * DT)
    assert found.overshoot == pytest.approx(0.1)
