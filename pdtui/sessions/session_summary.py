"""Summary statistics of a session."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pdtui.sessions.episode_statistics import EpisodeStatistics, EpisodeStatisticsCounter
from pdtui.sessions.session_reader import Session


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
        falls: number of episodes that ended by themselves.
        involvement: number of control steps in which a key was pressed.
        total_reward, total_cost: sums over all steps, including those that were rewound.
        stimulated: number of control steps in which units were overwritten.
        tallies: statistics of the episodes, ordered by their numbers.
        attributes: the robot's attributes in their order; the mean of an angle that wraps is meaningless.
    """

    steps: int
    seconds: float
    episodes: int
    falls: int
    involvement: int
    total_reward: float
    total_cost: float
    stimulated: int
    tallies: tuple[EpisodeStatistics, ...]
    attributes: tuple[AttributeSummary, ...]


def summarise_session(session: Session) -> SessionSummary:
    """Compute the summary statistics of a session."""
    keyed = {event.step for event in session.events if event.key}
    return SessionSummary(
        steps=session.steps,
        seconds=session.seconds,
        episodes=int(session.episodes.max(initial=-1)) + 1,
        falls=len(session.endings),
        involvement=len(keyed),
        total_reward=float(session.rewards.sum()),
        total_cost=float(session.costs.sum()),
        stimulated=sum(bool(stimulation.units) for stimulation in session.stimulations),
        tallies=_count_episodes(session, keyed),
        attributes=_summarise_attributes(session),
    )


def _count_episodes(session: Session, keyed: set[int]) -> tuple[EpisodeStatistics, ...]:
    counter = EpisodeStatisticsCounter(session.info)
    steps = zip(session.episodes.tolist(), session.costs.tolist(), session.attributes, strict=True)
    for step, (episode, cost, attributes) in enumerate(steps):
        counter.add(episode, keyed=step in keyed, cost=cost, attributes=attributes)
    return counter.all


def _summarise_attributes(session: Session) -> tuple[AttributeSummary, ...]:
    found = []
    for column, attribute in enumerate(session.info.attributes):
        values = session.attributes[:, column]
        values = values[np.isfinite(values)]
        mean, std = (float(values.mean()), float(values.std())) if len(values) else (math.nan, math.nan)
        found.append(AttributeSummary(attribute.name, attribute.unit, mean, std))
    return tuple(found)
