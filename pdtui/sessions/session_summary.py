"""Summary statistics of a session."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.core.step_record import is_involvement_step
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.episode_statistics import EpisodeStatistics, EpisodeStatisticsCounter
from pdtui.sessions.rrd.end_index import read_end_index
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.streams.running_moments import RunningMoments

_COUNTED_AT_ONCE = 1024
"""Control steps that are counted at once: one by one would take longer than the recording itself."""

_ALLOWED: dict[Any, Any] = {int: int, float: int | float, str: str, float | None: int | float | None}
"""Types in the index of what has a type in Python."""


@dataclass(frozen=True)
class AttributeSummary:
    """Mean and standard deviation of an attribute over the steps in which it is finite."""

    attribute: str
    unit: str
    mean: float
    std: float


@dataclass(frozen=True)
class SessionSummary:
    """Summary statistics of a session.

    Attributes:
        steps: number of control steps.
        seconds: simulated time, s.
        episodes: number of episodes that began.
        outcomes: how episodes ended, or that their task was done, and how often.
        involvement: number of control steps that count as human involvement (`is_involvement_step`).
        total_reward, total_cost: sums over all steps, including those that were rewound.
        stimulated: number of control steps in which units were overwritten.
        tallies: statistics of the episodes, ordered by their numbers.
        attributes: the robot's attributes in their order; the mean of an angle that wraps is meaningless.
        taken_over: number of control steps in which the operator set a component of the action.
    """

    steps: int
    seconds: float
    episodes: int
    outcomes: OutcomeCounts
    involvement: int
    total_reward: float
    total_cost: float
    stimulated: int
    tallies: tuple[EpisodeStatistics, ...]
    attributes: tuple[AttributeSummary, ...]
    taken_over: int = 0


class SessionSummaryCounter:
    """Counts the summary statistics of a session whose control steps come in blocks of any size.

    The size of the blocks affects no bit of the result.

    Args:
        info: the drive.
    """

    def __init__(self, info: DriveInfo) -> None:
        self._info = info
        self._moments = RunningMoments(len(info.attributes))
        self._statistics = EpisodeStatisticsCounter(info)
        self._pending: list[tuple[NDArray[Any], ...]] = []
        self._rows = 0
        self._steps = self._involvement = self._stimulated = self._taken_over = 0
        self._outcomes: list[tuple[int, Outcome]] = []
        self._last_episode = -1
        self._reward = self._cost = 0.0

    def add(
        self,
        *,
        attributes: Floats,
        rewards: Floats,
        costs: Floats,
        episodes: NDArray[np.int64],
        involved: NDArray[np.bool_],
        stimulated: NDArray[np.bool_],
        taken_over: NDArray[np.bool_],
        outcomes: Iterable[tuple[int, Outcome]] = (),
    ) -> None:
        """Add n control steps in their order. The counter keeps the arrays, which must not be changed.

        Args:
            attributes: shape (n, J).
            rewards, costs, episodes: shape (n,).
            involved: whether each step counts as human involvement, shape (n,).
            stimulated: whether units were overwritten in each step, shape (n,).
            taken_over: whether the operator set a component of the action of each step, shape (n,).
            outcomes: the outcomes that came about, each after the number of its episode.
        """
        self._outcomes += outcomes
        self._pending.append((attributes, rewards, costs, episodes, involved, stimulated, taken_over))
        self._rows += len(rewards)
        if self._rows >= _COUNTED_AT_ONCE:
            self._count_pending()

    def summary(self) -> SessionSummary:
        """Return the statistics so far."""
        self._count_pending(all_rows=True)
        for episode, outcome in self._outcomes:
            self._statistics.add_outcome(episode, outcome)
        rows = zip(self._info.attributes, self._moments.mean, self._moments.deviation, strict=True)
        return SessionSummary(
            steps=self._steps,
            seconds=self._steps * self._info.dt,
            episodes=self._last_episode + 1,
            outcomes=count_outcomes(outcome for _, outcome in self._outcomes),
            involvement=self._involvement,
            total_reward=self._reward,
            total_cost=self._cost,
            stimulated=self._stimulated,
            tallies=self._statistics.all,
            attributes=tuple(
                AttributeSummary(attribute.name, attribute.unit, float(mean), float(deviation))
                for attribute, mean, deviation in rows
            ),
            taken_over=self._taken_over,
        )

    def _count_pending(self, *, all_rows: bool = False) -> None:
        """Count in pieces of the same size, so that sums are rounded in the same way."""
        if not self._rows:
            return
        columns = [np.concatenate(column) for column in zip(*self._pending, strict=True)]
        whole = self._rows if all_rows else self._rows - self._rows % _COUNTED_AT_ONCE
        for start in range(0, whole, _COUNTED_AT_ONCE):
            self._count(*(column[start : min(start + _COUNTED_AT_ONCE, whole)] for column in columns))
        self._rows -= whole
        self._pending = [tuple(column[whole:] for column in columns)] if self._rows else []

    def _count(
        self,
        attributes: Floats,
        rewards: Floats,
        costs: Floats,
        episodes: NDArray[np.int64],
        involved: NDArray[np.bool_],
        stimulated: NDArray[np.bool_],
        taken_over: NDArray[np.bool_],
    ) -> None:
        self._moments.add(attributes)
        self._statistics.add_steps(episodes, involved=involved, costs=costs, attributes=attributes)
        self._steps += len(rewards)
        self._involvement += int(np.count_nonzero(involved))
        self._stimulated += int(np.count_nonzero(stimulated))
        self._taken_over += int(np.count_nonzero(taken_over))
        self._last_episode = max(self._last_episode, int(episodes.max()))
        self._reward += float(rewards.sum())
        self._cost += float(costs.sum())


def read_session_summary(session: SessionHeader) -> SessionSummary:
    """Read the summary statistics of a session from the index at its end, or compute them without one.

    Raises:
        SessionError: as `summarize_session`.
    """
    index = read_end_index(session.path) or {}
    try:
        return _decode_summary(index["summary"])
    except (KeyError, TypeError, AttributeError):
        return summarize_session(session)


def summarize_session(session: SessionHeader) -> SessionSummary:
    """Compute the summary statistics of a session from its file, of which a block at a time is in memory.

    Raises:
        SessionError: the file is damaged or incomplete.
    """
    # Not needed by sessions with an index, and takes longer to load than that takes to read.
    from pdtui.sessions.streams.step_block_reader import read_step_blocks

    counter = SessionSummaryCounter(session.info)
    keyed = np.array(sorted({event.step for event in session.events if event.key}), np.int64)
    for block in read_step_blocks(session):
        taken_over = block.replaced_counts > 0
        counter.add(
            attributes=block.attributes,
            rewards=block.rewards,
            costs=block.costs,
            episodes=block.episodes,
            involved=is_involvement_step(np.isin(block.steps, keyed), taken_over),
            stimulated=block.stimulated_counts > 0,
            taken_over=taken_over,
            outcomes=[
                (int(block.episodes[np.searchsorted(block.steps, step)]), outcome)
                for step, outcome in block.outcomes.items()
            ],
        )
    return counter.summary()


def _decode_counts(counts: dict[str, Any]) -> OutcomeCounts:
    known = {outcome.value: outcome for outcome in Outcome}
    if not all(isinstance(count, int) for count in counts.values()):
        raise TypeError("outcomes are not as expected")
    return {known[word]: count for word, count in counts.items()}


def _decode_summary(fields: dict[str, Any]) -> SessionSummary:
    """Return a summary from the index; fields that are not as expected are a `KeyError` or a `TypeError`."""
    tallies = tuple(EpisodeStatistics(**tally) for tally in fields["tallies"])
    attributes = tuple(AttributeSummary(**attribute) for attribute in fields["attributes"])
    parts = {"tallies": tallies, "attributes": attributes, "outcomes": _decode_counts(fields["outcomes"])}
    summary = SessionSummary(**{**fields, **parts})
    for item in (summary, *tallies, *attributes):
        for name, value in vars(item).items():
            wanted = get_type_hints(type(item))[name]
            if name not in parts and not isinstance(value, _ALLOWED[wanted]):
                raise TypeError(f"{name} is not as expected")
    return summary
