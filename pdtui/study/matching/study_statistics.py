"""What the data of the matching study say: figures of each policy, tests over policies, and the answer."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.probing.matching_hits import rank_correlation
from pdtui.probing.null_distributions import correct_for_comparisons, sign_flip_p_values
from pdtui.study.matching.study_data import NO_RANK, ROLES, MatchingStudyData, MeasuredUnits

MEASURES = ("first", "best", "correlation", "sign")
"""Hit rate of the first match and of the best few, rank correlation, and share of signs that agree."""


class StudyAnswer(StrEnum):
    """What the study answers."""

    YES = "yes"
    SELDOM = "better than chance, but seldom"
    NO = "no"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class PolicyMeans:
    """Means over the attributes of one policy.

    Attributes:
        policy: Its name.
        attributes: Number of its attributes.
        variants: For each variant and each of `MEASURES` the figure, shape (variants, 4).
        random: Share of hits among the further random units.
        probing: Share of attributes for which the random unit that is strongest on the choosing starts hits.
        probing_correlation: Rank correlation of the strength on the choosing starts with that on the others.
        ceiling: How well the strength on held-out starts repeats itself: the rank correlation of both halves,
            corrected to all of them by Spearman and Brown.
    """

    policy: str
    attributes: int
    variants: Floats
    random: float
    probing: float
    probing_correlation: float
    ceiling: float


@dataclass(frozen=True)
class TestedMean:
    """A mean over policies with its 95 % interval, and the test of its difference from chance.

    Attributes:
        mean, low, high: The mean and the ends of the interval.
        difference: Mean difference from chance.
        p: p-value of that difference; NaN where nothing is tested.
        corrected: The p-value, corrected for all tests of the study.
    """

    mean: float
    low: float
    high: float
    difference: float = float("nan")
    p: float = float("nan")
    corrected: float = float("nan")


@dataclass(frozen=True)
class StudyResult:
    """The result of the study.

    Attributes:
        figures: One entry for each policy that walks.
        variants: The mean for each variant and measure, in the order of the plan and of `MEASURES`.
        random, probing, probing_correlation, ceiling: Means over policies.
        answer: The answer by the rule of the plan.
    """

    figures: tuple[PolicyMeans, ...]
    variants: dict[str, tuple[TestedMean, ...]]
    random: TestedMean
    probing: TestedMean
    probing_correlation: TestedMean
    ceiling: TestedMean
    answer: StudyAnswer


def analyze_study(data: MatchingStudyData) -> StudyResult:
    """Compute what the plan in the data says is computed, and the answer."""
    by_policy: dict[str, list[MeasuredUnits]] = defaultdict(list)
    for one in data.measured:
        by_policy[one.policy].append(one)
    plan = data.plan
    figures = tuple(
        _describe_policy(name, some, plan.quantile, plan.settings.best) for name, some in by_policy.items()
    )
    values = np.array([one.variants for one in figures]).reshape(-1, len(plan.variants), len(MEASURES))
    chance = np.zeros_like(values)
    chance[:, :, :2] = np.array([one.random for one in figures])[:, None, None]
    chance[:, :, MEASURES.index("sign")] = 0.5
    flat = [
        (values[:, variant, measure], chance[:, variant, measure])
        for variant in range(len(plan.variants))
        for measure in range(len(MEASURES))
    ]
    p_values = [_test(one - expected) for one, expected in flat]
    corrected = correct_for_comparisons(p_values)
    means = [
        _mean(one, plan.resamples, expected, p, float(adjusted))
        for (one, expected), p, adjusted in zip(flat, p_values, corrected, strict=True)
    ]
    size = len(MEASURES)
    variants = {
        name: tuple(means[number * size : (number + 1) * size]) for number, name in enumerate(plan.variants)
    }

    def over_policies(name: str) -> TestedMean:
        return _mean(np.array([getattr(one, name) for one in figures]), plan.resamples)

    deciding = variants[plan.primary][MEASURES.index("first")]
    return StudyResult(
        figures,
        variants,
        over_policies("random"),
        over_policies("probing"),
        over_policies("probing_correlation"),
        over_policies("ceiling"),
        _answer(deciding, len(figures), plan.level, plan.enough),
    )


def _answer(deciding: TestedMean, policies: int, level: float, enough: float) -> StudyAnswer:
    if not policies or 2.0 ** (1 - policies) > level:
        return StudyAnswer.UNKNOWN
    if not (deciding.p <= level and deciding.difference > 0):
        return StudyAnswer.NO
    return StudyAnswer.YES if deciding.mean >= enough else StudyAnswer.SELDOM


def _test(differences: Floats) -> float:
    known = differences[np.isfinite(differences)]
    return float(sign_flip_p_values(known)) if len(known) else 1.0


def _mean(
    values: Floats,
    resamples: int,
    chance: Floats | None = None,
    p: float = float("nan"),
    corrected: float = float("nan"),
) -> TestedMean:
    known = np.isfinite(values)
    if not known.any():
        return TestedMean(*[float("nan")] * 3)
    low, high = bootstrap_interval(values, 0, draws=resamples)
    difference = float("nan") if chance is None else float((values - chance)[known].mean())
    return TestedMean(float(values[known].mean()), low, high, difference, p, corrected)


def _describe_policy(name: str, measured: Sequence[MeasuredUnits], quantile: float, best: int) -> PolicyMeans:
    rows = [_describe_attribute(one, quantile, best) for one in measured]
    variants = _nanmean(np.array([row[0] for row in rows]))
    others = _nanmean(np.array([row[1:] for row in rows], np.float64)).tolist()
    return PolicyMeans(name, len(rows), variants, *others)


def _nanmean(values: Floats) -> Floats:
    """Return the means over the first axis without NaN; NaN where there is nothing else."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))


def _describe_attribute(
    one: MeasuredUnits, quantile: float, best: int
) -> tuple[Floats, float, float, float, float]:
    """Return the figures of one attribute, in the order of the fields of `PolicyMeans`."""
    choosing, first, second = (_strength(group) for group in one.effects)
    held_out_effects = one.effects[1:].mean(axis=0)
    held_out = _strength(held_out_effects)
    direction = np.sign(held_out_effects[-1] - held_out_effects[0])
    drawn = one.roles != ROLES.index("matched")
    threshold = np.quantile(held_out[one.roles == ROLES.index("reference")], quantile)
    hits = (held_out > threshold) & (held_out > 0)
    half = rank_correlation(first[drawn], second[drawn])
    variants = np.full((len(one.ranks), len(MEASURES)), np.nan)
    for row, (ranks, rho) in enumerate(zip(one.ranks, one.correlations, strict=True)):
        if not (ranks == 0).any():
            continue  # the variant leaves the attribute out
        among = ranks < best
        told = among & np.isfinite(rho) & (rho != 0) & (direction != 0)
        counted = drawn & (ranks != NO_RANK)
        variants[row] = (
            float(hits[ranks == 0][0]),
            float(hits[among].mean()),
            rank_correlation(-ranks[counted].astype(np.float64), held_out[counted]),
            float((np.sign(rho) == direction)[told].mean()) if told.any() else np.nan,
        )
    return (
        variants,
        float(hits[one.roles == ROLES.index("random")].mean()),
        float(hits[drawn][np.argmax(choosing[drawn])]),
        rank_correlation(choosing[drawn], held_out[drawn]),
        2 * half / (1 + half) if half > -1 else float("nan"),
    )


def _strength(effects: Floats) -> Floats:
    """Return the largest effect in size over the values, shape (N,), of effects of shape (values, N)."""
    return np.asarray(np.abs(effects).max(axis=0))
