"""The results of the forest experiment: figures of each condition over repeats, and their ratios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from rich.console import Group
from rich.table import Table

from pdtui.core.confidence_intervals import PairedRatio, paired_ratio
from pdtui.core.console.text_tables import format_mean_with_interval, format_seed_range, new_table
from pdtui.core.outcome import Outcome, is_failure
from pdtui.evaluation.paired_statistics import share_interval
from pdtui.paper.forest.forest_episode import ForestEpisodeScore
from pdtui.paper.forest.key_motion_model import KeyMotionModel
from pdtui.paper.repeat_statistics import RepeatStatistics, summarize_repeats

ForestCondition = Literal["alone", "operator", "placebo", "vision"]
COMPARED: tuple[tuple[ForestCondition, ForestCondition], ...] = (
    ("operator", "alone"),
    ("placebo", "alone"),
    ("operator", "placebo"),
    ("operator", "vision"),
)
"""Conditions that are compared in the same forests."""


@dataclass(frozen=True)
class ForestConditionSummary:
    """The figures of one condition over all repeats, per episode.

    Attributes:
        distance: distance along x, m.
        collisions: number of trees that the robot ran into.
        involvement: number of control steps before which a key was pressed.
        fall_share: exact 95 % interval of the share of episodes that end with a fall.
    """

    condition: str
    policy: str
    reward: RepeatStatistics
    distance: RepeatStatistics
    collisions: RepeatStatistics
    presses: RepeatStatistics
    involvement: RepeatStatistics
    falls: int
    fall_share: tuple[float, float]
    crossed: int
    episodes: int
    runs: tuple[ForestEpisodeScore, ...]


@dataclass(frozen=True)
class ForestConditionRatio:
    """One condition over another in the same forests, with 95 % intervals over pairs of episodes.

    Attributes:
        condition, baseline: names of the two.
        distance: ratio of distances along x.
        collisions: ratio of numbers of collisions.
        collisions_per_meter: the same per distance, since who gets farther meets more trees.
    """

    condition: str
    baseline: str
    distance: PairedRatio
    collisions: PairedRatio
    collisions_per_meter: PairedRatio


@dataclass(frozen=True)
class ForestExperimentResult:
    """The result of the forest experiment.

    Attributes:
        seeds: seeds of the forests; empty if only sessions were scored.
        repeats: number of repeats into which the seeds are divided in their order.
        steps: largest number of control steps per episode.
        seconds: the same in simulated time, s.
        left_out: the conditions that were not measured, and the reasons.
        keys: the operator's models of its keys; empty if the operator was not measured.
        key_seeds: seeds of the drives to which these models were fitted.
    """

    robot: str
    seeds: tuple[int, ...]
    repeats: int
    steps: int
    seconds: float
    conditions: tuple[ForestConditionSummary, ...]
    ratios: tuple[ForestConditionRatio, ...]
    left_out: dict[str, str]
    keys: dict[str, KeyMotionModel]
    key_seeds: tuple[int, ...]
    sessions: tuple[str, ...]


def summarize_condition(
    condition: str, policy: str, runs: Sequence[ForestEpisodeScore], repeats: int
) -> ForestConditionSummary:
    """Return the figures of one condition; consecutive runs form a repeat."""

    def spread(name: str) -> RepeatStatistics:
        values = np.array([float(getattr(run, name)) for run in runs]).reshape(repeats, -1).mean(axis=1)
        return summarize_repeats(values)

    falls = sum(is_failure(run.outcome) for run in runs)
    return ForestConditionSummary(
        condition,
        policy,
        spread("reward"),
        spread("distance"),
        spread("collisions"),
        spread("presses"),
        spread("pressed_steps"),
        falls,
        share_interval(falls, len(runs)),
        sum(run.outcome is Outcome.ARRIVED for run in runs),
        len(runs),
        tuple(runs),
    )


def compare_conditions(
    runs: Mapping[ForestCondition, Sequence[ForestEpisodeScore]], names: Mapping[ForestCondition, str]
) -> tuple[ForestConditionRatio, ...]:
    """Return the ratios of the conditions that were measured, with runs in the same order of forests.

    Args:
        runs: runs by condition.
        names: name of each condition in tables.
    """

    distances = {name: np.array([run.distance for run in its]) for name, its in runs.items()}
    collisions = {name: np.array([run.collisions for run in its]) for name, its in runs.items()}

    def compare(above: ForestCondition, below: ForestCondition) -> ForestConditionRatio:
        far, hit = (distances[above], distances[below]), (collisions[above], collisions[below])
        return ForestConditionRatio(
            names[above], names[below], paired_ratio(*far), paired_ratio(*hit), paired_ratio(*hit, per=far)
        )

    return tuple(compare(*pair) for pair in COMPARED if set(pair) <= set(runs))


def forest_table(result: ForestExperimentResult) -> Group:
    """Return a table with one column per condition and figures per episode, and notes below it."""
    measured = f", {format_seed_range(result.seeds)} in {result.repeats} repeats" if result.seeds else ""
    rows = result.conditions
    table = new_table(
        f"{result.robot} in the forest, at most {result.steps} steps ({result.seconds:g} s){measured}",
        *("per episode", *(row.condition for row in rows)),
    )
    table.add_row("policy", *(row.policy for row in rows))
    table.add_row("reward", *(f"{row.reward:.0f}" for row in rows))
    table.add_row("distance along x (m)", *(f"{row.distance:.2f}" for row in rows))
    table.add_row("collisions", *(f"{row.collisions:.2f}" for row in rows))
    table.add_row("collisions per 100 m", *map(_collisions_per_100_m, rows))
    table.add_row("key presses", *(f"{row.presses:.1f}" for row in rows))
    table.add_row("steps with a key press", *(f"{row.involvement:.1f}" for row in rows))
    table.add_row("falls", *(f"{row.falls}/{row.episodes}" for row in rows))
    table.add_row("share of falls [95 %]", *map(_fall_share, rows))
    table.add_row("crossed the forest", *(f"{row.crossed}/{row.episodes}" for row in rows))
    notes = ["Mean ± standard deviation over repeats. An episode ends at a fall or at the far end."]
    if result.sessions:
        notes.append("The first episode of each scored session counts as a repeat.")
    notes += [f"Not measured: {condition}: {reason}" for condition, reason in result.left_out.items()]
    return Group(table, *([_ratios_table(result.ratios)] if result.ratios else []), *notes)


def _ratios_table(ratios: Sequence[ForestConditionRatio]) -> Table:
    table = new_table("Ratios [95 %], paired by forest", "", "distance", "collisions", "collisions per meter")
    for row in ratios:
        figures = (row.distance, row.collisions, row.collisions_per_meter)
        cells = (format_mean_with_interval(one.value, one.low, one.high) for one in figures)
        table.add_row(f"{row.condition} / {row.baseline}", *cells)
    return table


def _collisions_per_100_m(row: ForestConditionSummary) -> str:
    return f"{100 * row.collisions.mean / row.distance.mean:.1f}" if row.distance.mean else ""


def _fall_share(row: ForestConditionSummary) -> str:
    low, high = row.fall_share
    return f"{row.falls / row.episodes:.2f} [{low:.2f}, {high:.2f}]"
