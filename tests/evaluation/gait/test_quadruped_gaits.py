"""The lags of four feet that touch down by hand, and the names of their gaits."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.evaluation.gait.quadruped_gaits import (
    IRREGULAR,
    PhaseLags,
    average_lags,
    measure_phase_lags,
    name_gait,
)

STRIDE, STRIDES = 40, 12


def _walk(lags: tuple[float, float, float, float], duty: float = 0.5) -> np.ndarray:
    """Return contacts, shape (T, 4), of feet that lag behind the first by these shares of a stride."""
    phases = np.arange(STRIDE * STRIDES)[:, None] / STRIDE - np.array(lags)
    return np.asarray(phases % 1.0 < duty)


@pytest.mark.parametrize(
    ("gait", "lags"),
    [
        ("trot", (0.0, 0.5, 0.5, 0.0)),
        ("trot", (0.0, 0.45, 0.55, 0.05)),
        ("pace", (0.0, 0.5, 0.0, 0.5)),
        ("bound", (0.0, 0.05, 0.5, 0.5)),
        ("gallop", (0.0, 0.2, 0.5, 0.7)),
        ("gallop", (0.0, 0.8, 0.3, 0.5)),
        ("walk", (0.0, 0.5, 0.75, 0.25)),
        ("pronk", (0.0, 0.0, 0.95, 0.0)),
    ],
)
def test_a_gait_is_named_by_its_lags(gait: str, lags: tuple[float, float, float, float]) -> None:
    found = measure_phase_lags(_walk(lags))
    assert found is not None
    np.testing.assert_allclose(found.lags, lags, atol=1.0 / STRIDE)
    assert found.regularity == pytest.approx(1.0, abs=0.01)
    assert name_gait(found) == gait


def test_feet_that_touch_down_at_any_time_have_no_gait() -> None:
    contacts = np.random.default_rng(0).random((4000, 4)) < 0.3
    found = measure_phase_lags(contacts)
    assert found is not None
    assert found.regularity < 0.2
    assert name_gait(found) == IRREGULAR


def test_a_foot_that_never_touches_down_has_no_lag() -> None:
    contacts = _walk((0.0, 0.5, 0.5, 0.0))
    contacts[:, 2] = False
    assert measure_phase_lags(contacts) is None


def test_lags_are_averaged_round_the_circle() -> None:
    walks = [PhaseLags((0.0, 0.5, 0.4, lag), 0.9) for lag in (0.9, 0.1)]
    mean = average_lags(walks)
    assert mean.lags[1:3] == pytest.approx((0.5, 0.4))
    assert min(mean.lags[3], 1.0 - mean.lags[3]) == pytest.approx(0.0, abs=1e-9)
    assert mean.regularity == pytest.approx(0.9)
