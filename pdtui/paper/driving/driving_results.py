"""The results of the driving experiment: Table 1 of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Group
from rich.table import Table

from pdtui.core.confidence_intervals import PairedRatio, paired_ratio
from pdtui.core.console.text_tables import format_mean_with_interval, new_table
from pdtui.evaluation.paired_statistics import share_interval
from pdtui.paper.driving.drive_operators import SharedControl
from pdtui.paper.driving.driving_episode import DrivingScore
from pdtui.paper.driving.key_effects import KeyEffects
from pdtui.paper.repeat_statistics import RepeatStatistics, summarize_repeats

CONTROL_NAMES: dict[SharedControl, str] = {
    "alone": "alone",
    "keys": "H*",
    "takeover": "H^n",
    "human only": "human only",
}
"""The paper's names of the ways to share control."""


@dataclass(frozen=True)
class DrivingRow:
    """The figures of one row of the table.

    Attributes:
        policy: Name of the policy; empty for an operator without one.
        driver: ``program`` or ``person``; empty for a policy alone.
        success: Share of episodes that reach the destination.
        success_share: Its exact 95 % interval over all episodes.
        out_of_road: Share of episodes that end off the road.
        reward, cost: The paper's return and cost of an episode.
        involvement: Control steps of an episode in which the operator was involved; None for a policy alone.
        presses: Key presses of an episode; None for a policy alone.
        repeats: Number of repeats.
        scores: Scores of all episodes, repeat after repeat.
    """

    policy: str
    control: SharedControl
    driver: str
    success: RepeatStatistics
    success_share: tuple[float, float]
    out_of_road: RepeatStatistics
    reward: RepeatStatistics
    cost: RepeatStatistics
    involvement: RepeatStatistics | None
    presses: RepeatStatistics | None
    repeats: int
    scores: tuple[DrivingScore, ...]


@dataclass(frozen=True)
class InvolvementRatio:
    """Involvement with keys over that with takeovers, paired by scene and repeat, with its 95 % interval."""

    policy: str
    ratio: PairedRatio


@dataclass(frozen=True)
class DrivingExperimentResult:
    """The result of the driving experiment.

    Attributes:
        scenes: Names of the scenes.
        repeats: Number of repeats of every row with an operator.
        effects: What the operator was told of its keys, by policy.
        left_out: Policies that were not measured, and the reasons.
        sessions: Files of people's drives.
    """

    robot: str
    scenes: tuple[str, ...]
    repeats: int
    rows: tuple[DrivingRow, ...]
    ratios: tuple[InvolvementRatio, ...]
    effects: Mapping[str, KeyEffects]
    left_out: Mapping[str, str]
    sessions: tuple[str, ...]


def summarize_row(
    policy: str, control: SharedControl, driver: str, repeats: Sequence[Sequence[DrivingScore]]
) -> DrivingRow:
    """Return a row from the scores of each repeat's episodes."""

    def figure(name: str) -> RepeatStatistics:
        means = np.array([np.mean([float(getattr(one, name)) for one in scores]) for scores in repeats])
        return summarize_repeats(means)

    scores = tuple(one for repeat in repeats for one in repeat)
    operated = control != "alone"
    return DrivingRow(
        policy,
        control,
        driver,
        figure("success"),
        share_interval(sum(one.success for one in scores), len(scores)),
        figure("out_of_road"),
        figure("reward"),
        figure("cost"),
        figure("involvement") if operated else None,
        figure("presses") if operated else None,
        len(repeats),
        scores,
    )


def compare_involvement(rows: Sequence[DrivingRow]) -> tuple[InvolvementRatio, ...]:
    """Return the ratio of involvement for each policy that was driven with keys and with takeovers."""
    ratios = []
    for keys in rows:
        for takeover in rows:
            same = (
                (takeover.policy, takeover.driver) == (keys.policy, keys.driver) == (keys.policy, "program")
            )
            if same and (keys.control, takeover.control) == ("keys", "takeover"):
                above, below = (
                    np.array([float(one.involvement) for one in row.scores]) for row in (keys, takeover)
                )
                ratios.append(InvolvementRatio(keys.policy, paired_ratio(above, below)))
    return tuple(ratios)


def driving_table(result: DrivingExperimentResult) -> Group:
    """Return the table, with notes below it."""
    count = len(result.scenes)
    table = new_table(
        f"{result.robot} among traffic and obstacles, {count} scenes" if count else f"{result.robot}: drives",
        *("policy", "driven", "success", "out of road", "return", "cost", "involvement"),
        left=("policy", "driven"),
    )
    for row in result.rows:
        table.add_row(
            row.policy,
            CONTROL_NAMES[row.control] + (", a person" if row.driver == "person" else ""),
            f"{row.success:.2f}",
            f"{row.out_of_road:.2f}",
            f"{row.reward:.1f}",
            f"{row.cost:.2f}",
            "–" if row.involvement is None else f"{row.involvement:.1f}",
        )
    return Group(table, *([_ratio_table(result.ratios)] if result.ratios else []), *_notes(result))


def _notes(result: DrivingExperimentResult) -> list[str]:
    notes = ["Involvement: control steps of an episode in which a key was pressed or the operator steered."]
    if result.scenes:
        notes.append(
            f"Mean ± standard deviation of {result.repeats} repeats, in each of which the operator judges "
            "distances and speeds otherwise. A policy alone acts the same every time: it is run once."
        )
    if result.sessions:
        scenes = {one.scene for row in result.rows if row.driver == "person" for one in row.scores}
        notes.append(f"People drove {len(result.sessions)} times: {', '.join(sorted(scenes))}.")
    return notes + [f"Not measured: {policy}: {reason}" for policy, reason in result.left_out.items()]


def _ratio_table(ratios: Sequence[InvolvementRatio]) -> Table:
    table = new_table("Involvement of H* / that of H^n [95 %]", "policy", "ratio")
    for one in ratios:
        table.add_row(one.policy, format_mean_with_interval(one.ratio.value, one.ratio.low, one.ratio.high))
    return table
