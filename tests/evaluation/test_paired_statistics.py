"""The statistics of an evaluation against independent computation, and by simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from pdtui.core.confidence_intervals import confidence_interval
from pdtui.evaluation.paired_statistics import (
    holm_correction,
    share_interval,
    sign_flip_p_value,
    studentized_interval,
)


@pytest.mark.parametrize("skewed", [False, True])
def test_the_interval_covers_the_mean_of_20_values_as_often_as_it_says(skewed: bool) -> None:
    rng = np.random.default_rng(1)
    draws = rng.exponential(size=(200, 20)) - 1.0 if skewed else rng.normal(size=(200, 20))
    intervals = [studentized_interval(values, seed=number) for number, values in enumerate(draws)]
    covered = sum(low <= 0.0 <= high for low, high in intervals) / len(draws)
    # The standard error of the share is 0.015. A percentile interval covers 0.92 and 0.90 of these.
    assert 0.91 <= covered <= 0.985


def test_an_interval_of_values_of_one_sign_can_contain_zero() -> None:
    values = np.array([0.01, 0.02, 0.01, 0.03, 0.02, 0.01, 0.02, 9.0])
    low, high = studentized_interval(values)
    assert low < 0.0 < high


def test_few_or_equal_values_have_students_interval() -> None:
    values = np.array([0.5, 1.0, 2.5])
    assert studentized_interval(values) == confidence_interval(values)
    assert studentized_interval(np.full(20, 2.0)) == (2.0, 2.0)


@pytest.mark.parametrize("count", [8, 20])
def test_a_test_of_no_effect_rejects_as_often_as_its_level_says(count: int) -> None:
    rng = np.random.default_rng(2)
    draws = rng.standard_t(3, size=(300, count))
    p_values = np.array([sign_flip_p_value(values, seed=number) for number, values in enumerate(draws)])
    rejected = float((p_values < 0.05).mean())
    assert 0.02 <= rejected <= 0.08  # 0.05 ± 2.4 standard errors


def test_sign_flips_agree_with_scipy_and_find_an_effect() -> None:
    rng = np.random.default_rng(3)
    for count in (6, 12, 20):
        values = rng.normal(0.4, 1.0, count)
        expected = stats.permutation_test((values,), np.mean, permutation_type="samples", rng=5).pvalue
        assert sign_flip_p_value(values) == pytest.approx(expected, abs=0.015)
    assert sign_flip_p_value(rng.normal(2.0, 1.0, 20)) <= 0.001
    assert sign_flip_p_value(np.zeros(20)) == 1.0
    assert sign_flip_p_value(np.ones(4)) == 2 / 2**4


def test_sign_flips_of_successes_are_mcnemars_test() -> None:
    differences = np.array([1.0] * 7 + [-1.0] + [0.0] * 5)
    assert sign_flip_p_value(differences) == pytest.approx(stats.binomtest(7, 8).pvalue)


@pytest.mark.parametrize(("successes", "count"), [(0, 20), (20, 20), (7, 20), (1, 2)])
def test_the_interval_of_a_share_is_clopper_and_pearsons(successes: int, count: int) -> None:
    low, high = share_interval(successes, count)
    assert low == pytest.approx(stats.beta.ppf(0.025, successes, count - successes + 1) if successes else 0.0)
    assert high == pytest.approx(
        stats.beta.ppf(0.975, successes + 1, count - successes) if successes < count else 1.0
    )


def test_no_trials_say_nothing() -> None:
    assert share_interval(0, 0) == (0.0, 1.0)
    assert sign_flip_p_value(np.empty(0)) == 1.0


def test_the_correction_is_holms() -> None:
    assert holm_correction([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm_correction([0.6, 0.7]) == [1.0, 1.0]
    assert holm_correction([]) == []
    rng = np.random.default_rng(4)
    tables = rng.uniform(size=(2000, 20))
    false = sum(min(holm_correction(table.tolist())) < 0.05 for table in tables) / len(tables)
    assert 0.035 <= false <= 0.065
