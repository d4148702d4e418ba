"""What the forest experiment found: figures of each condition, over repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pdtui.paper.forest.forest_episode import ForestEpisode
from pdtui.paper.forest.key_motion_model import KeyMotionModel


@dataclass(frozen=True)
class RepeatStatistics:
    """Mean over repeats, and their standard deviation (n − 1); NaN for a single repeat."""

    mean: float
    std: float


@dataclass(frozen=True)
class ForestConditionSummary:
    """One condition over all repeats; figures are per episode.

    Attributes:
        condition: in words.
        policy: name of the weights.
        reward: return.
        distance: along x, m.
        collisions: trees that the robot ran into.
        presses: keys pressed.
        involvement: control steps before which a key was pressed.
        falls: episodes that ended with a fall, of `episodes`.
        crossed: episodes that reached the forest's far end.
        episodes: in all.
        runs: every episode.
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
    """All conditions that were measured.

    Attributes:
        robot: that was driven.
        seeds: of the forests; empty where only sessions were scored.
        repeats: into which the seeds are divided in their order.
        steps: control steps an episode lasts at most.
        seconds: the same in simulated time.
        conditions: in the order in which they are printed.
        left_out: conditions that were not measured, and why.
        keys: what the operator found out about its keys; empty without it.
        key_seeds: on which.
        sessions: files that were scored.
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

    def as_dict(self) -> dict[str, Any]:
        """The form that ``--json`` prints."""
        return asdict(self)


def summarise_condition(
    condition: str, policy: str, runs: Sequence[ForestEpisode], repeats: int
) -> ForestConditionSummary:
    """The figures of one condition; consecutive runs make a repeat."""

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
