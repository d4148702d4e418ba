"""Confirmation can say no: noise is confirmed no more often than stated, and a planted effect is found."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.attributes import Floats
from pdtui.dissection.primitive_judging import PrimitiveJudgment
from pdtui.probing.matching_hits import measure_noise_ceiling
from pdtui.probing.measured_effects import PlanEffects, SingleUnitEffects, UnitEffects
from pdtui.probing.null_distributions import (
    correct_for_comparisons,
    random_unit_p_value,
    sign_flip_p_values,
    smallest_p_value,
)
from pdtui.probing.primitive_confirmation import EffectVerdict, judge_candidates, judge_effects
from pdtui.probing.unit_selection import PrimitiveCandidate

LEVEL = 0.05
STARTS, CONTROLS, PAIRS, UNITS = 10, 99, 16, 140


def test_sign_flips_are_all_flips_counted_by_hand() -> None:
    values = np.random.default_rng(0).normal(0.4, 1.0, 6)
    sums = [abs(np.dot(signs, values)) for signs in itertools.product((-1, 1), repeat=6)]
    by_hand = np.mean([one >= abs(values.sum()) - 1e-12 for one in sums])
    assert sign_flip_p_values(values) == pytest.approx(by_hand)


def test_values_of_one_sign_have_the_smallest_p_that_the_starts_allow() -> None:
    for starts in (1, 2, 5, 8):
        assert sign_flip_p_values(np.linspace(1, 2, starts)) == pytest.approx(2.0 ** (1 - starts))
        assert smallest_p_value(starts, 10**6) == pytest.approx(max(2.0 ** (1 - starts), 1e-6), rel=1e-3)
    assert sign_flip_p_values(np.zeros((3, 8))).tolist() == [1.0] * 3
    assert sign_flip_p_values(np.linspace(1, 2, 20)) == pytest.approx(1 / 4096)


def test_p_of_random_units_counts_those_that_are_as_strong() -> None:
    assert random_unit_p_value(2.0, np.array([0.5, 1.0, 2.0, 3.0])) == pytest.approx(3 / 5)
    assert random_unit_p_value(9.0, np.zeros(19)) == pytest.approx(1 / 20)


def test_correction_is_that_of_benjamini_and_hochberg() -> None:
    # By hand: sorted p times 4 / rank, then the least from the right.
    np.testing.assert_allclose(
        correct_for_comparisons([0.04, 0.001, 0.03, 0.5]), [0.16 / 3, 0.004, 0.16 / 3, 0.5]
    )
    assert correct_for_comparisons([]).size == 0


def _share_of_tables_with_a_confirmation(rng: np.random.Generator, tables: int, heavy: bool) -> float:
    """Tables of noise, common to all units from a start in part, in which the candidates are random units."""
    found = 0
    for _ in range(tables):
        shape = CONTROLS + PAIRS, STARTS
        noise = rng.standard_t(2, shape) if heavy else rng.normal(size=shape)
        noise = noise * np.exp(rng.normal(size=(len(noise), 1))) + 0.5 * rng.normal(size=STARTS)
        controls, pairs = noise[:CONTROLS], noise[CONTROLS:]
        verdicts = judge_effects(
            pairs,
            rng.choice((-1.0, 1.0), PAIRS).tolist(),
            [controls] * PAIRS,
            [3.0] * PAIRS,
            [0] * PAIRS,
            LEVEL,
            None,
        )
        found += any(one.confirmed for one in verdicts)
    return found / tables


@pytest.mark.parametrize("heavy", [False, True])
def test_of_pure_noise_no_more_is_confirmed_than_stated(heavy: bool) -> None:
    share = _share_of_tables_with_a_confirmation(np.random.default_rng(int(heavy)), 2000, heavy)
    # All is noise, so every confirmation is false; three standard errors of 2000 tables.
    assert share <= LEVEL + 3 * np.sqrt(LEVEL * (1 - LEVEL) / 2000)


def probe(rng: np.random.Generator, effects: dict[int, float], spread: float) -> SingleUnitEffects:
    """Noisy effects of `UNITS` units on one attribute at ±3 and ±0.5, with some planted, linear in v."""
    outputs = [(unit, value) for unit in range(UNITS) for value in (-3.0, -0.5, 0.5, 3.0)]
    planted = np.array([effects.get(unit, 0.0) * value / 3.0 for unit, value in outputs])
    noise = rng.normal(0.0, spread, (len(outputs), STARTS))
    values: Floats = (planted[:, None] + noise)[..., None]
    return SingleUnitEffects(
        {output: row for row, output in enumerate(outputs)},
        PlanEffects(
            values,
            values,
            np.zeros((STARTS, 1)),
            np.zeros(values.shape[:2], np.bool_),
            np.full(values.shape[:2], np.nan),
            np.zeros(STARTS, np.bool_),
        ),
    )


CANDIDATES = [PrimitiveCandidate(unit, 0, 3.0, 1.0) for unit in (0, 1, 2, 3)]
OWN_RANGE = np.tile([-0.5, 0.5], (UNITS, 1))


def test_a_planted_effect_is_confirmed_and_its_neighbors_are_not() -> None:
    probed = probe(np.random.default_rng(3), {0: 2.0}, 0.5)
    first, *others = judge_candidates(CANDIDATES, probed, OWN_RANGE, range(20, 119), LEVEL)
    assert first.confirmed
    assert first.both_ways
    assert first.verdict.measured.effect == pytest.approx(2.0, abs=0.5)
    assert (first.verdict.flip_p, first.verdict.random_p) == (2.0**-9, 0.01)
    assert not any(one.confirmed for one in others)


def test_an_effect_of_the_other_sign_than_where_it_was_chosen_is_not_confirmed() -> None:
    probed = probe(np.random.default_rng(3), {0: -2.0}, 0.5)
    first, *_ = judge_candidates(CANDIDATES, probed, OWN_RANGE, range(20, 119), LEVEL)
    assert first.verdict.flip_p == 2.0**-9
    assert not first.confirmed


def test_what_all_units_do_is_confirmed_for_none() -> None:
    """A stop of any unit at |v| = 20 is no discovery about a unit."""
    probed = probe(np.random.default_rng(4), dict.fromkeys(range(UNITS), 2.0), 0.5)
    verdicts = judge_candidates(CANDIDATES, probed, OWN_RANGE, range(20, 119), LEVEL)
    assert all(one.verdict.flip_p == 2.0**-9 for one in verdicts)
    assert not any(one.confirmed for one in verdicts)


def test_outputs_outside_a_units_own_range_are_marked_and_judged_at_its_end() -> None:
    probed = probe(np.random.default_rng(5), {0: 6.0}, 0.1)
    inside = OWN_RANGE.copy()
    inside[1] = [-4.0, 4.0]
    outer, inner, *_ = judge_candidates(CANDIDATES, probed, inside, range(20, 119), LEVEL)
    assert (outer.in_range, outer.own_range.value) == (False, 0.5)
    assert outer.own_range.measured.effect == pytest.approx(1.0, abs=0.2)
    assert outer.own_range.confirmed
    assert (inner.in_range, inner.own_range.value) == (True, 3.0)


def test_a_fall_counts_as_no_effect() -> None:
    probed = probe(np.random.default_rng(3), {0: 2.0}, 0.5)
    falls = np.zeros_like(probed.plans.falls)
    falls[probed.rows[0, 3.0], :7] = True
    fallen = replace(probed, plans=replace(probed.plans, falls=falls))
    first, *_ = judge_candidates(CANDIDATES, fallen, OWN_RANGE, range(20, 119), LEVEL)
    assert first.verdict.measured.falls == 7
    assert first.verdict.flip_p == pytest.approx(2.0**-2)
    assert not first.confirmed


def judgment(starts: int, controls: int) -> PrimitiveJudgment:
    empty = UnitEffects(
        (), (), np.zeros((0, 0, 0, 1)), np.zeros((0, 0, 0), bool), np.zeros((0, 1)), np.zeros(0, bool)
    )
    probed = probe(np.random.default_rng(3), {0: 2.0}, 0.5)
    confirmations = judge_candidates(CANDIDATES, probed, OWN_RANGE, range(20, 119), LEVEL)
    return PrimitiveJudgment(confirmations, tuple(range(controls)), empty, OWN_RANGE, starts, LEVEL)


def test_too_few_starts_or_units_are_known_before_anything_is_confirmed() -> None:
    assert judgment(4, 100).fewest_confirmed is None
    assert judgment(8, 15).fewest_confirmed is None
    assert judgment(8, 100).fewest_confirmed == 1
    # 4 pairs at p = 1/32 pass together with 4 · 1/32 / 0.05 = 2.5, that is 3, of them.
    assert judgment(6, 1000).fewest_confirmed == 3


def test_an_effect_that_passes_is_no_primitive() -> None:
    probed = probe(np.random.default_rng(3), {0: 2.0}, 0.5)
    first, *_ = judge_candidates(CANDIDATES, probed, OWN_RANGE, range(20, 119), LEVEL)
    gone: EffectVerdict = replace(first.verdict, corrected_p=0.4)
    assert not replace(first, held=gone).confirmed
    assert replace(first, held=first.verdict).confirmed
    little = replace(first.verdict, measured=replace(first.verdict.measured, effect=0.8))
    assert not replace(first, held=little).confirmed


def _ceiling(spread: float) -> float:
    rng = np.random.default_rng(7)
    strengths = rng.normal(size=(200, 1, 1, 1))
    effects = strengths + rng.normal(0.0, spread, (200, 1, STARTS, 1))
    no_falls = np.zeros(effects.shape[:3], bool)
    table = UnitEffects(
        tuple(range(200)), (3.0,), effects, no_falls, np.zeros((STARTS, 1)), np.zeros(STARTS, bool)
    )
    return measure_noise_ceiling(table, range(200), 0, (3.0,))


def test_the_noise_ceiling_falls_with_noise() -> None:
    assert _ceiling(0.01) > 0.99
    assert 0.3 < _ceiling(1.0) < 0.9
    assert abs(_ceiling(1000.0)) < 0.25
