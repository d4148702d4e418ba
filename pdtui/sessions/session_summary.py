"""What a drive came to, in figures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pdtui.sessions.episode_statistics import EpisodeStatistics, EpisodeStatisticsCounter
from pdtui.sessions.session_reader import Session


@dataclass(frozen=True)
class AttributeSummary:
    """Mean and standard deviation of an attribute over a session, steps without a number left out."""

    attribute: str
    unit: str
    mean: float
    std: float


@dataclass(frozen=True)
class SessionSummary:
    """What a drive came to.

    Attributes:
        steps: control steps.
        seconds: simulated time, s.
        episodes: that were begun.
        falls: episodes that ended by themselves.
        involvement: control steps in which a key was pressed.
        total_reward, total_cost: sums over all steps, rewound ones included.
        stimulated: control steps in which units were overwritten.
        tallies: of the episodes, in the order of their numbers.
        attributes: of the robot, in its order; an angle that wraps has no mean that means something.
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
    """Sum a session up."""
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
        tallies=_tallies(session, keyed),
        attributes=_attributes(session),
    )


def _tallies(session: Session, keyed: set[int]) -> tuple[EpisodeStatistics, ...]:
    tallies = EpisodeStatisticsCounter(session.info)
    steps = zip(session.episodes.tolist(), session.costs.tolist(), session.attributes, strict=True)
    for step, (episode, cost, attributes) in enumerate(steps):
        tallies.add(episode, keyed=step in keyed, cost=cost, attributes=attributes)
    return tallies.all


def _attributes(session: Session) -> tuple[AttributeSummary, ...]:
    found = []
    for column, attribute in enumerate(session.info.attributes):
        values = session.attributes[:, column]
        values = values[np.isfinite(values)]
        mean, std = (float(values.mean()), float(values.std())) if len(values) else (math.nan, math.nan)
        found.append(AttributeSummary(attribute.name, attribute.unit, mean, std))
    return tuple(found)
