"""The results of the forest experiment: figures of each condition over repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.paper.forest.forest_episode import ForestEpisode
from pdtui.paper.forest.key_motion_model import KeyMotionModel


@dataclass(frozen=True)
class RepeatStatistics:
    """Mean over repeats and their standard deviation (n − 1), which is NaN for a single repeat."""

    mean: float
    std: float


@dataclass(frozen=True)
class ForestConditionSummary:
    """The figures of one condition over all repeats, per episode.

    Attributes:
        distance: distance along x, m.
        collisions: number of trees that the robot ran into.
        presses: number of key presses.
        involvement: number of control steps before which a key was pressed.
        crossed: number of episodes that reached the far end of the forest.
    """

    condition: str
    policy: str
    reward: RepeatStatistics
    distance: RepeatStatistics
    collisions: RepeatStatistics
    presses: RepeatStatistics
    involvement: RepeatStatistics
    falls: int
    crossed: int
    episodes: int
    runs: tuple[ForestEpisode, ...]


@dataclass(frozen=True)
class ForestExperimentResult:
    """The result of the forest experiment.

    Attributes:
        seeds: seeds of the forests; empty if only sessions were scored.
        repeats: number of repeats into which the seeds are divided in their order.
        steps: largest number of control steps per episode.
        seconds: the same in simulated time, s.
        conditions: the figures of each condition.
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
    left_out: dict[str, str]
    keys: dict[str, KeyMotionModel]
    key_seeds: tuple[int, ...]
    sessions: tuple[str, ...]


def summarise_condition(
    condition: str, policy: str, runs: Sequence[ForestEpisode], repeats: int
) -> ForestConditionSummary:
    """Return the figures of one condition; consecutive runs form a repeat."""

    def spread(name: str) -> RepeatStatistics:
        values = np.array([float(getattr(run, name)) for run in runs]).reshape(repeats, -1).mean(axis=1)
        return RepeatStatistics(
            float(values.mean()), float(values.std(ddof=1)) if repeats > 1 else float("nan")
        )

    return ForestConditionSummary(
        condition,
        policy,
        spread("reward"),
        spread("distance"),
        spread("collisions"),
        spread("presses"),
        spread("pressed_steps"),
        sum(run.fell for run in runs),
        sum(run.crossed for run in runs),
        len(runs),
        tuple(runs),
    )
