"""The data of the dissection benchmark: recorded episodes, widened to any number of units and attributes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute
from pdtui.core.errors import PdtuiError
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.spectra.monitor import MonitoredEpisode, monitor_episodes

_SHIFT = 37
"""Control steps by which a repeated column is shifted; no multiple of a hop, so that the series differ."""


@dataclass(frozen=True)
class DissectionBenchmarkSettings:
    """How much the dissection benchmark measures.

    Attributes:
        episodes, steps, units, attributes: size of the recorded data; steps per episode.
        rounds: rounds of each comparison, in which both sides take turns.
        factors: each size is multiplied by these to see how time grows with it.
        memory_units, memory_steps: size of the synthetic episode whose memory is measured.
        probes: stimulated roll-outs per round.
        probe_steps: control steps per roll-out.
    """

    episodes: int = 5
    steps: int = 1000
    units: int = 512
    attributes: int = 20
    rounds: int = 7
    factors: tuple[float, ...] = (0.25, 0.5, 1, 2, 4)
    memory_units: int = 100_000
    memory_steps: int = 1000
    probes: int = 240
    probe_steps: int = 60


def record_episodes(
    pool: RolloutPool, settings: DissectionBenchmarkSettings
) -> tuple[list[MonitoredEpisode], tuple[Attribute, ...]]:
    """Record episodes without stimulation, widened to the numbers of units and attributes of the settings.

    Raises:
        PdtuiError: an episode ended before its number of steps.
    """
    recorded = monitor_episodes(
        pool.robot, pool.policy, range(1000, 1000 + settings.episodes), settings.steps
    )
    for episode in recorded:
        if episode.steps < settings.steps:
            raise PdtuiError(
                f"{pool.robot.name}: expected {settings.steps} steps, but the episode of seed {episode.seed} "
                f"ended after {episode.steps}: {episode.ended}"
            )
    episodes = [widen_episode(episode, settings.units, settings.attributes) for episode in recorded]
    known = pool.robot.attributes
    attributes = tuple(
        replace(known[column % len(known)], name=f"{known[column % len(known)].name} {column}")
        for column in range(settings.attributes)
    )
    return episodes, attributes


def widen_episode(episode: MonitoredEpisode, units: int, attributes: int) -> MonitoredEpisode:
    """Return the episode with other widths; columns beyond the recorded ones repeat them, shifted in time."""
    return replace(
        episode,
        activations=_widened(episode.activations, units),
        attributes=_widened(episode.attributes, attributes),
    )


def _widened(series: NDArray[Any], width: int) -> NDArray[Any]:
    copies = -(-width // series.shape[1])
    shifted = [np.roll(series, _SHIFT * copy, axis=0) for copy in range(copies)]
    return np.ascontiguousarray(np.hstack(shifted)[:, :width])
