from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.confidence_intervals import PairedRatio, bootstrap_interval, paired_ratio


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


def test_a_ratio_pairs_its_values() -> None:
    rng = np.random.default_rng(5)
    below = rng.uniform(0.05, 5.0, 20)
    exact = paired_ratio(1.5 * below, below)
    assert (exact.value, exact.low, exact.high) == pytest.approx((1.5, 1.5, 1.5))
    noisy = paired_ratio(1.5 * below * rng.uniform(0.9, 1.1, 20), below)
    assert 1.4 < noisy.low < noisy.value < noisy.high < 1.6
    shuffled = paired_ratio(rng.permutation(1.5 * below), below)
    assert shuffled.high / shuffled.low > (noisy.high / noisy.low) ** 3
    per_meter = paired_ratio(below, below, per=(2.0 * below, below))
    assert (per_meter.value, per_meter.low, per_meter.high) == pytest.approx((0.5, 0.5, 0.5))


def test_a_ratio_that_cannot_be_known_has_an_open_interval() -> None:
    ones, none = np.ones(20), np.zeros(20)
    assert paired_ratio(none, ones) == PairedRatio(0.0, 0.0, np.inf)
    assert paired_ratio(ones, none) == PairedRatio(np.inf, 0.0, np.inf)
    assert paired_ratio(ones[:1], ones[:1]) == PairedRatio(1.0, 0.0, np.inf)
    assert paired_ratio(-ones, ones) == PairedRatio(-1.0, 0.0, np.inf)
    seldom = paired_ratio(np.array([1.0] + 19 * [0.0]), ones)
    assert seldom.low < 0.02 < seldom.value < seldom.high
    few = paired_ratio(np.array([1.0, 2.0, 3.0]), np.ones(3))
    assert few.low < 1.0 < few.value < 4.0 < few.high
