"""Decide from starts that chose nothing which units are motor primitives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.probing.measured_effects import SingleUnitEffects
from pdtui.probing.null_distributions import correct_for_comparisons, random_unit_p_value, sign_flip_p_values
from pdtui.probing.unit_selection import PrimitiveCandidate
from pdtui.stimulation.stimulation_map import MeasuredEffect

LASTING = 0.5
"""Share of an effect on a rate that has to be left late in a long roll-out."""


@dataclass(frozen=True)
class EffectVerdict:
    """Whether the effect of one output of a unit on one attribute is more than chance.

    Attributes:
        value: output v at which the unit was held.
        measured: mean effect with its 95 % interval over the starts, and the falls, which count as no effect.
        flip_p: p-value against flips of the signs of the paired differences, see `sign_flip_p_values`.
        random_p: p-value against units drawn at random and held in the same way; None if there were none.
        corrected_p: the larger of the two, corrected for all comparisons; 1 where the effect has another sign
            than on the starts that chose the unit.
        level: share of false discoveries that is accepted.
    """

    value: float
    measured: MeasuredEffect
    flip_p: float
    random_p: float | None
    corrected_p: float
    level: float

    @property
    def confirmed(self) -> bool:
        """Whether the corrected p-value is at most the level."""
        return self.corrected_p <= self.level


@dataclass(frozen=True)
class PrimitiveConfirmation:
    """What probing says about one unit and one attribute.

    Attributes:
        unit: flat index.
        column: column of the attribute.
        verdict: the effect of the output that was chosen for the unit.
        in_range: whether the unit puts out such values by itself.
        own_range: the effect of that end of the unit's own range that is nearest to the output; equal to
            `verdict` if the output is in range.
        both_ways: whether v and −v move the attribute opposite ways (by sign flips, not corrected).
        held: the effect late in a roll-out that is much longer; None where it was not measured.
    """

    unit: int
    column: int
    verdict: EffectVerdict
    in_range: bool
    own_range: EffectVerdict
    both_ways: bool
    held: EffectVerdict | None = None

    @property
    def lasts(self) -> bool:
        """Whether the long roll-out still shows `LASTING` of the effect; also if there was none."""
        if self.held is None:
            return True
        left = abs(self.held.measured.effect) >= LASTING * abs(self.verdict.measured.effect)
        return self.held.confirmed and left

    @property
    def confirmed(self) -> bool:
        """Whether the effect is more than chance, and lasts where that was measured."""
        return self.verdict.confirmed and self.lasts


def judge_effects(
    differences: Floats,
    signs: Sequence[float],
    controls: Sequence[Floats] | None,
    values: Sequence[float],
    falls: Sequence[int],
    level: float,
    seed: int | None = 0,
) -> list[EffectVerdict]:
    """Judge the effects of P pairs of a unit and an attribute together.

    Args:
        differences: effects from K starts, shape (P, K).
        signs: the sign of each effect on the starts that chose it.
        controls: for each pair, the effects of C units drawn at random on the same attribute, held in the
            same way from the same starts, shape (C, K); None for no such comparison.
        values: the outputs v.
        falls: the number of starts from which the robot fell.
        level: share of false discoveries that is accepted.
        seed: seed of the intervals; None for no intervals, which take most of the time.
    """
    if not len(differences):
        return []
    means = differences.mean(axis=-1)
    flips = sign_flip_p_values(differences)
    randoms: list[float | None] = [None] * len(differences)
    if controls is not None:
        pairs = zip(means, controls, strict=True)
        randoms = [random_unit_p_value(abs(mean), np.abs(some.mean(axis=-1))) for mean, some in pairs]
    larger = [
        max(flip, random or 0.0) if sign * mean > 0 else 1.0
        for flip, random, sign, mean in zip(flips.tolist(), randoms, signs, means, strict=True)
    ]
    corrected, nothing = correct_for_comparisons(larger), (float("nan"), float("nan"))
    return [
        EffectVerdict(
            values[row],
            MeasuredEffect(
                float(means[row]),
                *(nothing if seed is None else bootstrap_interval(differences[row], seed)),
                falls[row],
                differences.shape[-1],
            ),
            float(flips[row]),
            randoms[row],
            float(corrected[row]),
            level,
        )
        for row in range(len(differences))
    ]


def judge_candidates(
    candidates: Sequence[PrimitiveCandidate],
    probed: SingleUnitEffects,
    own_range: Floats,
    controls: Sequence[int],
    level: float,
    seed: int | None = 0,
) -> tuple[PrimitiveConfirmation, ...]:
    """Judge candidates together: at their outputs, and at the ends of their own ranges.

    Each is compared with the controls at the same output, or at the same end of their own ranges.

    Args:
        candidates: pairs of a unit and an attribute.
        probed: effects of their units and of the controls, from starts that chose neither: at the outputs of
            the candidates, at the opposite ones, and at the ends of the own ranges.
        own_range: lowest and highest output of every unit by itself, shape (U, 2).
        controls: units drawn at random. A candidate is not compared with itself.
        level: share of false discoveries that is accepted, separately for both.
        seed: seed of the intervals; None for no intervals, which take most of the time.
    """
    in_range = [bool(own_range[one.unit, 0] <= one.value <= own_range[one.unit, 1]) for one in candidates]

    def at_the_end(one: PrimitiveCandidate, unit: int) -> float:
        low, high = own_range[one.unit]
        return one.value if low <= one.value <= high else float(own_range[unit, int(one.value > high)])

    outputs = (lambda one, _: one.value), at_the_end
    chosen, ends = (_judge(candidates, output, probed, controls, level, seed) for output in outputs)
    return tuple(
        PrimitiveConfirmation(
            one.unit, one.column, verdict, inside, end, _opposite(one, verdict, probed, level)
        )
        for one, verdict, inside, end in zip(candidates, chosen, in_range, ends, strict=True)
    )


def _judge(
    candidates: Sequence[PrimitiveCandidate],
    output: Callable[[PrimitiveCandidate, int], float],
    probed: SingleUnitEffects,
    controls: Sequence[int],
    level: float,
    seed: int | None,
) -> list[EffectVerdict]:
    """Judge candidates where `output` says at which output a unit is held for a candidate."""
    differences, others, values, falls = [], [], [], []
    for one in candidates:
        values.append(output(one, one.unit))
        differences.append(probed.effects_of(one.unit, values[-1])[:, one.column])
        drawn = [unit for unit in controls if unit != one.unit]
        effects = [probed.effects_of(unit, output(one, unit))[:, one.column] for unit in drawn]
        others.append(np.array(effects).reshape(len(drawn), -1))
        falls.append(probed.falls_of(one.unit, values[-1]))
    signs = [one.sign for one in candidates]
    return judge_effects(np.array(differences), signs, others, values, falls, level, seed)


def _opposite(
    one: PrimitiveCandidate, verdict: EffectVerdict, probed: SingleUnitEffects, level: float
) -> bool:
    """Return whether the opposite output moves the attribute the other way."""
    opposite = probed.effects_of(one.unit, -one.value)[:, one.column]
    other_way = float(opposite.mean()) * verdict.measured.effect < 0
    return bool(other_way and sign_flip_p_values(opposite) <= level and verdict.flip_p <= level)
