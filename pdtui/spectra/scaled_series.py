"""The recorded series as matching compares them: scaled as the preset says, a block of units at a time."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from pdtui.core.attributes import Attribute, Floats
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.monitor import MonitoredEpisode

# Spectra of so many units and one episode of 1000 steps (2 MB) stay in a core's own cache.
BLOCK = 64
_Result = TypeVar("_Result")


def usable_episodes(episodes: Sequence[MonitoredEpisode], preset: MatchingPreset) -> list[MonitoredEpisode]:
    """The episodes that hold at least one window."""
    return [episode for episode in episodes if episode.steps >= preset.length]


def attribute_series(
    episodes: Sequence[MonitoredEpisode], attributes: Sequence[Attribute], preset: MatchingPreset
) -> list[Floats]:
    """The attributes of each episode, shape (T, J) each, at the scale at which they are compared."""
    series = [np.array(episode.attributes, np.float64) for episode in episodes]
    if preset.angles == "wrapped":
        for column, attribute in enumerate(attributes):
            if attribute.wraps:
                for values in series:
                    values[:, column] = np.pi - (np.pi - values[:, column]) % (2 * np.pi)
    if preset.scaling == "standardised":
        return _standardised(series)
    if preset.scaling == "observed":
        scales = np.array([attribute.scale for attribute in attributes])
        return [values * scales for values in series]
    return series


def unit_series(
    episodes: Sequence[MonitoredEpisode], units: slice, preset: MatchingPreset
) -> list[NDArray[Any]]:
    """Some units of each episode, shape (T, B) each, at the scale at which they are compared."""
    series = [episode.activations[:, units] for episode in episodes]
    return _standardised(series) if preset.scaling == "standardised" else series


def map_unit_blocks(
    work: Callable[[slice], _Result], units: int, block: int = BLOCK
) -> Iterator[tuple[slice, _Result]]:
    """Do some work for every block of units, on every core; memory grows by a block for each of them.

    Args:
        work: called with a block; numpy and scipy let go of the interpreter's lock, so threads are enough.
        units: how many there are.
        block: units at a time.

    Returns:
        each block and its result, in order.
    """
    blocks = [slice(low, min(low + block, units)) for low in range(0, units, block)]
    threads = min(os.cpu_count() or 1, max(1, len(blocks)))
    # Threads of the matrix products beside these would only wait for each other.
    with ThreadPoolExecutor(threads) as pool, _libraries().limit(limits=1, user_api="blas"):
        yield from zip(blocks, pool.map(work, blocks), strict=True)


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def _standardised(series: Sequence[NDArray[Any]]) -> list[Floats]:
    together = np.concatenate(series).astype(np.float64)
    mean, spread = together.mean(axis=0), together.std(axis=0)
    # The mean of equal numbers is not exactly that number: a series that never moves is all zeros.
    still = np.ptp(together, axis=0) == 0
    mean[still], spread[still] = together[0, still], 1.0
    return [(values - mean) / spread for values in series]
