"""Statistics of an episode, computed in the same way during a drive and from a session."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pdtui.core.attributes import Floats
    from pdtui.core.outcome import Outcome
    from pdtui.sessions.drive_info import DriveInfo


@dataclass(frozen=True)
class EpisodeStatistics:
    """Statistics of an episode so far.

    Attributes:
        episode: number of the episode.
        steps: number of control steps, including those that were rewound.
        involvement: number of control steps that count as human involvement (`is_involvement_step`).
        distance: latest value of the robot's attribute ``distance``, m; None if the robot lacks it.
        collisions: sum of the cost of all steps where there are obstacles, else None.
        passed: number of obstacles of a course that were passed, the latest value of the robot's attribute
            ``obstacles passed``; None if the robot lacks it.
        outcome: how it ended, or that its task was done; empty while there is no outcome.
    """

    episode: int = 0
    steps: int = 0
    involvement: int = 0
    distance: float | None = None
    collisions: float | None = None
    passed: float | None = None
    outcome: str = ""

    @property
    def share(self) -> float:
        """The share of control steps that count as human involvement, 0..1."""
        return self.involvement / max(1, self.steps)


NO_STATISTICS = EpisodeStatistics()
"""The statistics of a drive that has not begun."""


class EpisodeStatisticsCounter:
    """Counts the statistics of each episode; after a rewind, those of the earlier episode are continued."""

    def __init__(self, info: DriveInfo) -> None:
        columns = {(one.name, one.unit): column for column, one in enumerate(info.attributes)}
        self._column, self._passed = columns.get(("distance", "m")), columns.get(("obstacles passed", ""))
        self._none = EpisodeStatistics(
            distance=None if self._column is None else 0.0,
            collisions=0.0 if info.obstacles else None,
            passed=None if self._passed is None else 0.0,
        )
        self._statistics: dict[int, EpisodeStatistics] = {}

    def add(self, episode: int, *, involved: bool, cost: float, attributes: Floats) -> None:
        """Count one control step, with its cost, the attributes after it, and whether it was involvement."""
        before = self.of(episode)
        self._statistics[episode] = replace(
            before,
            steps=before.steps + 1,
            involvement=before.involvement + involved,
            distance=None if self._column is None else float(attributes[self._column]),
            collisions=None if before.collisions is None else before.collisions + cost,
            passed=None if self._passed is None else float(attributes[self._passed]),
        )

    def add_steps(
        self, episodes: NDArray[np.int64], *, involved: NDArray[np.bool_], costs: Floats, attributes: Floats
    ) -> None:
        """Count n control steps, n > 0: arrays of shape (n,), and attributes of shape (n, J)."""
        starts = [0, *(np.flatnonzero(np.diff(episodes)) + 1).tolist(), len(episodes)]
        for start, stop in pairwise(starts):
            before = self.of(int(episodes[start]))
            self._statistics[before.episode] = replace(
                before,
                steps=before.steps + stop - start,
                involvement=before.involvement + int(np.count_nonzero(involved[start:stop])),
                distance=None if self._column is None else float(attributes[stop - 1, self._column]),
                collisions=None
                if before.collisions is None
                else before.collisions + float(costs[start:stop].sum()),
                passed=None if self._passed is None else float(attributes[stop - 1, self._passed]),
            )

    def add_outcome(self, episode: int, outcome: Outcome) -> None:
        """Note the outcome of an episode; the last word counts."""
        self._statistics[episode] = replace(self.of(episode), outcome=outcome.value)

    def of(self, episode: int) -> EpisodeStatistics:
        """Return the statistics of an episode."""
        return self._statistics.get(episode) or replace(self._none, episode=episode)

    @property
    def all(self) -> tuple[EpisodeStatistics, ...]:
        """The statistics of all episodes that began, ordered by their numbers."""
        return tuple(statistics for _, statistics in sorted(self._statistics.items()))
