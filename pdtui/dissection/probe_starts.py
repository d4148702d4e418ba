"""The states that roll-outs begin in, and a shorter plan where the policy does not walk that long."""

from __future__ import annotations

from typing import NamedTuple

from pdtui.core.errors import RobotError
from pdtui.dissection.dissection_settings import DissectionSettings
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states, measure_walk_lengths
from pdtui.search.behavior_search import SearchStartStates

_SHORTEST = 24
_MORE = 4


class ProbeStarts(NamedTuple):
    """Snapshots for each stage; no walk is in two of them.

    Attributes:
        screen, refine: for the sweeps.
        searches: for everything after them.
        settings: Those asked for, with roll-outs as short as the walks require.
        shortened: what was made shorter, as a sentence; empty where nothing was.
    """

    screen: tuple[StartState, ...]
    refine: tuple[StartState, ...]
    searches: SearchStartStates
    settings: DissectionSettings
    shortened: str


def gather_probe_starts(pool: RolloutPool, settings: DissectionSettings, first_seed: int) -> ProbeStarts:
    """One snapshot a walk, from walks that go on for as long as the longest roll-out from there.

    Where too few of them do (a hopper that falls after two seconds), starts and roll-outs become as short as
    it takes: what a unit does within a second is still worth knowing.

    Raises:
        RobotError: the walks are too short even for that.
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
                f"{pool.robot.name}: expected {total} walks of at least {wanted} steps without a fall among "
                f"{len(seeds)} seeds, or shorter ones to make do with, but that many last {lasting} steps "
                "only; dissection needs a policy that stays up for a while"
            )
        shortened = (
            f"Of {len(seeds)} walks, {sum(length >= wanted for length in lengths)} lasted the {wanted} steps "
            f"asked for and {total} lasted {lasting}, so stimulation began at step {settings.walk_steps} and "
            f"lasted at most {settings.longest_rollout} steps. Effects beyond that were not measured."
        )
    everything = collect_start_states(
        pool.robot, pool.policy, first_seed, total, at=settings.walk_steps, survive=settings.longest_rollout
    )
    parts, taken = [], 0
    for count in counts:
        parts.append(tuple(everything[taken : taken + count]))
        taken += count
    return ProbeStarts(parts[0], parts[1], SearchStartStates(*parts[2:]), settings, shortened)
