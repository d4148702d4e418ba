from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.confidence_intervals import bootstrap_interval


def test_bootstrap_interval() -> None:
    samples = np.random.default_rng(0).normal(2.0, 1.0, 400)
    low, high = bootstrap_interval(samples, 1)
    # The normal approximation of the interval of this mean: ± 1.96 standard errors.
    half = 1.96 * samples.std() / 20
    assert low == pytest.approx(samples.mean() - half, abs=0.02)
    assert high == pytest.approx(samples.mean() + half, abs=0.02)
    assert bootstrap_interval(samples, 1) == (low, high)
    assert bootstrap_interval(np.append(samples, np.nan), 1) == (low, high)
    assert np.isnan(bootstrap_interval(np.array([1.0]), 1)).all()
