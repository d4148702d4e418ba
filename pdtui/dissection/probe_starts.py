"""Gathers the states in which roll-outs start, and shortens roll-outs if the policy does not walk long."""

from __future__ import annotations

from itertools import islice
from typing import NamedTuple

from pdtui.core.errors import RobotError
from pdtui.dissection.dissection_config import DissectionSettings
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states, measure_walk_lengths
from pdtui.search.behavior_search import SearchStartStates

_SHORTEST = 24
"""Control steps of the longest roll-out, below which dissecting is refused."""
_MORE = 4
"""Walks that are tried for each start state that is needed."""


class ProbeStarts(NamedTuple):
    """Start states for each stage of a dissection. No walk serves two stages.

    Attributes:
        screen, refine: Starts of the sweeps.
        searches: Starts of everything after them.
        settings: Those asked for, with roll-outs as short as the walks require.
        shortened: A sentence on what was shortened; empty if nothing was.
    """

    screen: tuple[StartState, ...]
    refine: tuple[StartState, ...]
    searches: SearchStartStates
    settings: DissectionSettings
    shortened: str


def gather_probe_starts(pool: RolloutPool, settings: DissectionSettings, first_seed: int) -> ProbeStarts:
    """Take one start state from each of several walks that last as long as the longest roll-out from there.

    If too few walks do (a hopper may fall after two seconds), starts and roll-outs are shortened: what a unit
    does within a second is still worth knowing.

    Raises:
        RobotError: The walks are too short even for that.
    """
    counts = (
        settings.screen_starts,
        settings.refine_starts,
        settings.search_starts,
        settings.selection_starts,
        settings.held_out_starts,
    )
    total, wanted, shortened = sum(counts), settings.walk_steps + settings.longest_rollout, ""
    seeds = range(first_seed, first_seed + _MORE * total)
    lengths = measure_walk_lengths(pool.robot, pool.policy, seeds, wanted, enough=total)
    lasting = sorted(lengths, reverse=True)[total - 1]
    if lasting < wanted:
        settings = settings.shortened_to(lasting)
        if settings.longest_rollout < _SHORTEST:
            raise RobotError(
                f"{pool.robot.name}: expected {total} walks of {wanted} steps without a fall, but of "
                f"{len(seeds)} walks only that many last {lasting} steps; dissection needs a policy that "
                "stays up longer"
            )
        shortened = (
            f"Of {len(seeds)} walks, {sum(length >= wanted for length in lengths)} lasted the {wanted} steps "
            f"asked for and {total} lasted {lasting}, so stimulation began at step {settings.walk_steps} and "
            f"lasted at most {settings.longest_rollout} steps. Effects beyond that were not measured."
        )
    everything = collect_start_states(
        pool.robot, pool.policy, first_seed, total, at=settings.walk_steps, survive=settings.longest_rollout
    )
    remaining = iter(everything)
    parts = [tuple(islice(remaining, count)) for count in counts]
    return ProbeStarts(parts[0], parts[1], SearchStartStates(*parts[2:]), settings, shortened)
