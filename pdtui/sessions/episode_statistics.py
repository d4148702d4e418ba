"""How an episode stands, in the figures that an operator drives by: the same live and from a session."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pdtui.core.attributes import Floats
    from pdtui.sessions.drive_info import DriveInfo


@dataclass(frozen=True)
class EpisodeStatistics:
    """What an episode came to, so far.

    Attributes:
        episode: its number.
        steps: control steps, rewound ones included.
        involvement: those in which a key was pressed: the paper's human involvement.
        distance: where the robot's attribute ``distance`` stands, m; None for a robot without.
        collisions: sum of the steps' cost, where there are obstacles; None where there are none.
    """

    episode: int = 0
    steps: int = 0
    involvement: int = 0
    distance: float | None = None
    collisions: float | None = None

    @property
    def share(self) -> float:
        """Part of the control steps in which a key was pressed, 0..1."""
        return self.involvement / max(1, self.steps)


NO_STATISTICS = EpisodeStatistics()
"""Of a drive that has not begun."""


class EpisodeStatisticsCounter:
    """One tally an episode; a rewind into an earlier episode goes on with that one's.

    Args:
        info: of the drive.
    """

    def __init__(self, info: DriveInfo) -> None:
        columns = [
            column
            for column, attribute in enumerate(info.attributes)
            if (attribute.name, attribute.unit) == ("distance", "m")
        ]
        self._column = columns[0] if columns else None
        self._none = EpisodeStatistics(
            distance=None if self._column is None else 0.0, collisions=0.0 if info.obstacles else None
        )
        self._tallies: dict[int, EpisodeStatistics] = {}

    def add(self, episode: int, *, keyed: bool, cost: float, attributes: Floats) -> None:
        """Take in one control step.

        Args:
            episode: its number.
            keyed: whether a key was pressed.
            cost: of the step.
            attributes: after the step, shape (J,).
        """
        before = self.of(episode)
        self._tallies[episode] = replace(
            before,
            steps=before.steps + 1,
            involvement=before.involvement + keyed,
            distance=None if self._column is None else float(attributes[self._column]),
            collisions=None if before.collisions is None else before.collisions + cost,
        )

    def of(self, episode: int) -> EpisodeStatistics:
        """How an episode stands."""
        return self._tallies.get(episode) or replace(self._none, episode=episode)

    @property
    def all(self) -> tuple[EpisodeStatistics, ...]:
        """Of every episode that was begun, in the order of their numbers."""
        return tuple(tally for _, tally in sorted(self._tallies.items()))
