"""What an evaluation says about one behavior in one condition, and its substitutes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from pdtui.core.attributes import Attribute
from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.evaluation.behavior_criteria import BehaviorCriterion, JudgedRun, choose_criterion
from pdtui.evaluation.effect_figures import (
    EffectSpecificity,
    WindowEffect,
    count_back_to_gait,
    measure_side_effects,
    onset_and_end,
    paired_effects,
    wanted_sign,
    window_effect,
)
from pdtui.evaluation.held_run import HeldRunTrace
from pdtui.evaluation.paired_statistics import share_interval
from pdtui.evaluation.protocol_settings import RunTimes
from pdtui.stimulation.stimulation_map import Behavior

AS_LARGE = 0.8
"""Share of the behavior's effect from which on a substitute's counts as as large."""


@dataclass(frozen=True)
class SubstituteFigures:
    """How a substitute for the behavior's units did, on seeds on which the behavior was run, too.

    Attributes:
        kind: ``random units``, ``random directions`` or ``actions``.
        draws: Number of draws; 1 for a push on the actions.
        seeds: Number of seeds of each draw.
        as_large: Draws whose mean effect in the last window is at least 80 % of the behavior's.
        as_large_at_first: The same in the first window.
        low, high: 95 % interval of the share `as_large` of `draws` (Clopper and Pearson).
        judged: Draws that meet the behavior's criterion on at least half of their seeds.
        effect: Median over draws of the mean effect in the last window.
        own_effect: That of the behavior on the same seeds.
        outcomes: How runs ended, of `draws` × `seeds`.
    """

    kind: str
    draws: int
    seeds: int
    as_large: int
    as_large_at_first: int
    low: float
    high: float
    judged: int
    effect: float
    own_effect: float
    outcomes: OutcomeCounts


@dataclass(frozen=True)
class BehaviorEvaluation:
    """What one behavior does in one condition.

    Attributes:
        behavior: Its name.
        condition: Name of the condition.
        attribute, unit: The attribute of its aim, and the unit of that.
        wanted: Sign of the wanted effect; that of ``stop`` is towards 0.
        criterion: What a person would call by its name, in words.
        seen, quantity: Median of what the criterion measures, and its name or unit.
        runs: Number of seeds.
        held: Time for which it is held, s.
        first, last: The effect in the first and the last window of the hold.
        onset: Median time until half of the effect of the first window is there, s; NaN if it never is.
        lasts: Median time until less than half of it is left for good, s.
        lasting: Number of runs in which that is the whole hold.
        judged: Number of runs that meet the criterion and do not fail before the release.
        judged_low, judged_high: 95 % interval of that share (Clopper and Pearson).
        judged_by_itself: Number of runs without a press that meet it.
        back: Number of runs that are back to the usual gait after the release.
        outcomes: How runs ended before their time.
        default_outcomes: How those without a press did.
        holds: Whether the effect of the last window is in the wanted direction and its corrected p-value
            below the level.
        side_effects: The effect beside those on the other attributes.
        seed_effects: Mean effect over the whole hold of each seed, in the order of the seeds.
        seed_met: Whether each seed meets the criterion.
        substitutes: How random units, random directions and a push on the actions did; empty for a disturbed
            condition, and for a behavior that overwrites no units.
    """

    behavior: str
    condition: str
    attribute: str
    unit: str
    wanted: float
    criterion: str
    seen: float
    quantity: str
    runs: int
    held: float
    first: WindowEffect
    last: WindowEffect
    onset: float
    lasts: float
    lasting: int
    judged: int
    judged_low: float
    judged_high: float
    judged_by_itself: int
    back: int
    outcomes: OutcomeCounts
    default_outcomes: OutcomeCounts
    holds: bool
    side_effects: EffectSpecificity
    seed_effects: tuple[float, ...]
    seed_met: tuple[bool, ...]
    substitutes: tuple[SubstituteFigures, ...] = ()


@dataclass(frozen=True)
class BehaviorRuns:
    """The runs of one behavior in one condition, and those without a press, in the order of the seeds.

    `possible` are the outcomes of the robot.
    """

    behavior: Behavior
    condition: str
    attributes: Sequence[Attribute]
    times: Sequence[RunTimes]
    traces: Sequence[HeldRunTrace]
    defaults: Sequence[HeldRunTrace]
    possible: Sequence[Outcome] = (Outcome.FELL,)

    @property
    def column(self) -> int:
        """The column of the aim's attribute."""
        assert self.behavior.aim is not None
        return [one.name for one in self.attributes].index(self.behavior.aim.attribute)

    @property
    def sign(self) -> float:
        """The sign of the wanted effect."""
        assert self.behavior.aim is not None
        return wanted_sign(self.behavior.aim, self.defaults, self.column)

    @property
    def criterion(self) -> BehaviorCriterion:
        """What a person would call by the behavior's name."""
        assert self.behavior.aim is not None
        return choose_criterion(self.behavior.name, self.behavior.aim, self.attributes)

    def judged_runs(self, traces: Sequence[HeldRunTrace]) -> list[JudgedRun]:
        """Return runs on the first seeds with what a criterion needs to judge them."""
        rows = zip(traces, self.defaults, self.times, strict=False)
        return [JudgedRun(trace, default, times, self.attributes) for trace, default, times in rows]

    def judge(self, traces: Sequence[HeldRunTrace]) -> list[bool]:
        """Return which runs meet the behavior's criterion."""
        return [self.criterion.is_met(run) for run in self.judged_runs(traces)]

    def measure(self) -> float:
        """Return the median of what the criterion measures; NaN if every run ended before."""
        seen = np.array([self.criterion.measure(run) for run in self.judged_runs(self.traces)])
        return float(np.nanmedian(seen)) if np.isfinite(seen).any() else float("nan")

    def count(self, traces: Iterable[HeldRunTrace]) -> OutcomeCounts:
        """Return how runs ended."""
        return count_outcomes((trace.outcome for trace in traces), self.possible)

    def wanted_effects(self, traces: Sequence[HeldRunTrace]) -> tuple[float, float]:
        """Return the mean effects in the first and the last window in the wanted direction."""
        effects = self.sign * paired_effects(traces, self.defaults[: len(traces)], self.column)
        times = self.times[0]
        return float(effects[:, times.first_bins].mean()), float(effects[:, times.last_bins].mean())


def summarize_behavior(runs: BehaviorRuns) -> BehaviorEvaluation:
    """Summarize the runs of one behavior; its p-values are not corrected yet."""
    behavior, times, column = runs.behavior, runs.times[0], runs.column
    assert behavior.aim is not None
    both = runs.traces, runs.defaults
    effects = paired_effects(*both, column)
    ends = np.array([onset_and_end(effect, times, runs.sign) for effect in effects])
    held = times.held * times.dt
    met, by_itself = runs.judge(runs.traces), sum(runs.judge(runs.defaults))
    judged = sum(met)
    judged_low, judged_high = share_interval(judged, len(runs.traces))
    onset = np.nanmedian(ends[:, 0]) if np.isfinite(ends[:, 0]).any() else np.nan
    return BehaviorEvaluation(
        behavior=behavior.name,
        condition=runs.condition,
        attribute=behavior.aim.attribute,
        unit=runs.attributes[column].unit,
        wanted=runs.sign,
        criterion=runs.criterion.words,
        seen=runs.measure(),
        quantity=runs.criterion.quantity,
        runs=len(runs.traces),
        held=held,
        first=window_effect(*both, column, times.first_bins),
        last=window_effect(*both, column, times.last_bins),
        onset=float(onset),
        lasts=float(np.median(ends[:, 1])),
        lasting=int((ends[:, 1] >= held - 1e-9).sum()),
        judged=judged,
        judged_low=judged_low,
        judged_high=judged_high,
        judged_by_itself=by_itself,
        back=count_back_to_gait(*both, runs.attributes, column),
        outcomes=runs.count(runs.traces),
        default_outcomes=runs.count(runs.defaults),
        holds=False,
        side_effects=measure_side_effects(*both, runs.attributes, column, times),
        seed_effects=tuple(effects[:, : times.held_bins].mean(axis=1).tolist()),
        seed_met=tuple(met),
    )


def summarize_substitute(
    kind: str, own: BehaviorRuns, draws: Sequence[Sequence[HeldRunTrace]]
) -> SubstituteFigures:
    """Compare draws of a substitute, each run on the first seeds of the behavior, with the behavior."""
    seeds = len(draws[0])
    own_first, own_last = own.wanted_effects(own.traces[:seeds])
    effects = np.array([own.wanted_effects(traces) for traces in draws])
    as_large = int((effects[:, 1] >= AS_LARGE * own_last).sum())
    return SubstituteFigures(
        kind,
        len(draws),
        seeds,
        as_large,
        int((effects[:, 0] >= AS_LARGE * own_first).sum()),
        *share_interval(as_large, len(draws)),
        sum(2 * sum(own.judge(traces)) >= seeds for traces in draws),
        float(np.median(effects[:, 1])) * own.sign,
        own_last * own.sign,
        own.count(chain.from_iterable(draws)),
    )
