"""The start states of a dissection, and roll-outs as short as the policy's walks require."""

from __future__ import annotations

from itertools import islice
from typing import NamedTuple

import numpy as np

from pdtui.core.errors import RobotError
from pdtui.dissection.dissection_config import DissectionSettings
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states, measure_walk_lengths
from pdtui.search.behavior_search import SearchStartStates

_SHORTEST = 24
"""Control steps of the longest roll-out, below which dissecting is refused."""
_WALKS = 20
"""Walks whose lengths decide how long roll-outs are."""
_LASTING = 0.75
"""Share of these walks that last as long as the longest roll-out."""


class ProbeStarts(NamedTuple):
    """Start states for each stage of a dissection. No walk serves two stages.

    Attributes:
        screen, refine: Starts of the sweeps, which choose units and outputs.
        judge: Starts that judge what these chose.
        searches: Starts of everything after that.
        settings: Those asked for, with roll-outs as short as the walks require.
        shortened: A sentence on what was shortened; empty if nothing was.
    """

    screen: tuple[StartState, ...]
    refine: tuple[StartState, ...]
    judge: tuple[StartState, ...]
    searches: SearchStartStates
    settings: DissectionSettings
    shortened: str


def gather_probe_starts(pool: RolloutPool, settings: DissectionSettings, first_seed: int) -> ProbeStarts:
    """Take one start state from each of several walks, whether or not the walk would go on for long.

    If more than a quarter of the walks do not last as long as the longest roll-out (a hopper may fall after
    two seconds, a car arrive after ten), starts and roll-outs are shortened: what a unit does within a second
    is still worth knowing. A roll-out that arrives is measured up to its end.

    Raises:
        RobotError: The walks are too short even for that.
    """
    counts = (
        settings.screen_starts,
        settings.refine_starts,
        settings.judge_starts,
        settings.search_starts,
        settings.selection_starts,
        settings.held_out_starts,
    )
    total, wanted, shortened = sum(counts), settings.walk_steps + settings.longest_rollout, ""
    seeds = range(first_seed, first_seed + _WALKS)
    lengths = measure_walk_lengths(pool.robot, pool.policy, seeds, wanted)
    lasting = int(np.quantile(lengths, 1 - _LASTING, method="lower"))
    if lasting < wanted:
        settings = settings.shortened_to(lasting)
        if settings.longest_rollout < _SHORTEST:
            raise RobotError(
                f"{pool.robot.name}: expected walks of {wanted} steps, but {_LASTING:.0%} of {len(seeds)} "
                f"walks last no longer than {lasting} steps; dissection needs walks that are longer"
            )
        shortened = (
            f"Of {len(seeds)} walks, {sum(length >= wanted for length in lengths)} lasted the {wanted} steps "
            f"asked for and {_LASTING:.0%} lasted {lasting}, so stimulation began by step "
            f"{settings.walk_steps} and lasted at most {settings.longest_rollout} steps. Effects beyond that "
            "were not measured."
        )
    steps = range(settings.walk_steps // 2, settings.walk_steps + 1)
    everything = collect_start_states(pool.robot, pool.policy, first_seed, total, at=steps)
    remaining = iter(everything)
    screen, refine, judge, *searches = (tuple(islice(remaining, count)) for count in counts)
    return ProbeStarts(screen, refine, judge, SearchStartStates(*searches), settings, shortened)
