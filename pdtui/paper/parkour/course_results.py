"""The results of the parkour experiment: figures of each condition over courses, and passages by obstacle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from rich.console import Group
from rich.table import Table

from pdtui.core.console.text_tables import format_seed_range, new_table
from pdtui.core.outcome import Outcome, OutcomeCounts
from pdtui.evaluation.paired_statistics import share_interval
from pdtui.paper.parkour.course_drive import ATTEMPTS_AT_ONE, CourseScore
from pdtui.robots.parkour.parkour_course import COUNT, LENGTH, OBSTACLE_KINDS, ObstacleKind

CourseCondition = Literal["alone", "operator"]


@dataclass(frozen=True)
class CourseConditionSummary:
    """The figures of one condition over all courses.

    Attributes:
        crossed: number of courses crossed.
        crossed_share: exact 95 % interval of the share of courses crossed.
        crossed_at_once: number of courses crossed in one attempt.
        ends: how attempts ended before the end of the course.
        involvement: share of the control steps of all drives before which a key was pressed.
    """

    condition: str
    policy: str
    courses: int
    crossed: int
    crossed_share: tuple[float, float]
    crossed_at_once: int
    passed: float
    ends: OutcomeCounts
    keys: float
    involvement: float
    runs: tuple[CourseScore, ...]


@dataclass(frozen=True)
class ObstaclePassage:
    """One attempt to pass one obstacle."""

    condition: str
    kind: ObstacleKind
    seed: int
    passed: bool


@dataclass(frozen=True)
class PassageCount:
    """How many attempts passed an obstacle of a kind, each on another course."""

    condition: str
    kind: ObstacleKind
    passed: int
    attempts: int


@dataclass(frozen=True)
class CourseExperimentResult:
    """The result of the parkour experiment.

    Attributes:
        seeds: seeds of the courses; empty if only sessions were scored.
        steps: largest number of control steps per course.
        seconds: the same in simulated time, s.
        passages: attempts at each kind of obstacle by itself, from a start behind the obstacle before it.
    """

    robot: str
    seeds: tuple[int, ...]
    steps: int
    seconds: float
    conditions: tuple[CourseConditionSummary, ...]
    passages: tuple[PassageCount, ...]
    sessions: tuple[str, ...]


def summarize_course_condition(
    condition: str, policy: str, runs: Sequence[CourseScore]
) -> CourseConditionSummary:
    """Return the figures of one condition."""
    crossed = sum(run.crossed for run in runs)
    ends = {one: sum(run.ends.get(one, 0) for run in runs) for one in Outcome}
    return CourseConditionSummary(
        condition,
        policy,
        len(runs),
        crossed,
        share_interval(crossed, len(runs)),
        sum(run.crossed and run.attempts == 1 for run in runs),
        float(np.mean([run.passed for run in runs])),
        {one: number for one, number in ends.items() if number},
        float(np.mean([len(run.keys) for run in runs])),
        sum(run.pressed_steps for run in runs) / sum(run.steps for run in runs),
        tuple(runs),
    )


def summarize_passages(passages: Sequence[ObstaclePassage]) -> tuple[PassageCount, ...]:
    """Count the attempts by condition and kind, in their order."""
    counts: dict[tuple[str, ObstacleKind], list[bool]] = {}
    for one in passages:
        counts.setdefault((one.condition, one.kind), []).append(one.passed)
    return tuple(
        PassageCount(condition, kind, sum(done), len(done)) for (condition, kind), done in counts.items()
    )


def parkour_table(result: CourseExperimentResult) -> Group:
    """Return a table with one column per condition, one of obstacles, and notes below them."""
    measured = f", {format_seed_range(result.seeds)}" if result.seeds else ""
    rows = result.conditions
    table = new_table(
        f"{result.robot} on courses of {LENGTH:g} m, at most {result.steps} steps "
        f"({result.seconds:g} s){measured}",
        *("", *(row.condition for row in rows)),
    )
    table.add_row("policy", *(row.policy for row in rows))
    table.add_row("courses crossed", *(f"{row.crossed}/{row.courses}" for row in rows))
    table.add_row("share crossed [95 %]", *map(_crossed_share, rows))
    table.add_row("crossed in one attempt", *(f"{row.crossed_at_once}/{row.courses}" for row in rows))
    table.add_row(f"obstacles passed, of {COUNT}", *(f"{row.passed:.1f}" for row in rows))
    for end in sorted({end for row in rows for end in row.ends}):
        counts = (row.ends.get(end, 0) / row.courses for row in rows)
        table.add_row(f"{end}, per course", *(f"{count:.1f}" for count in counts))
    table.add_row("key presses per course", *(f"{row.keys:.1f}" for row in rows))
    table.add_row("human involvement", *(f"{100 * row.involvement:.2f} %" for row in rows))
    parts: list[Table | str] = [table]
    if result.passages:
        parts.append(_passage_table(result.passages))
    parts.append(
        "A robot that fell or crashed began anew behind the last obstacle that it had passed. "
        f"After {ATTEMPTS_AT_ONE} attempts at one obstacle the drive was over."
    )
    return Group(*parts)


def _passage_table(passages: Sequence[PassageCount]) -> Table:
    names = list(dict.fromkeys(one.condition for one in passages))
    cells = {(one.condition, one.kind): f"{one.passed}/{one.attempts}" for one in passages}
    table = new_table("One attempt at one obstacle", "passed", *names)
    for kind in OBSTACLE_KINDS:
        table.add_row(kind, *(cells.get((name, kind), "") for name in names))
    return table


def _crossed_share(row: CourseConditionSummary) -> str:
    low, high = row.crossed_share
    return f"{row.crossed / row.courses:.2f} [{low:.2f}, {high:.2f}]"
