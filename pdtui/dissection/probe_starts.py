"""The states that roll-outs begin in, and a shorter plan where the policy does not walk that long."""

from __future__ import annotations

from typing import NamedTuple

from pdtui.core.errors import RobotError
from pdtui.dissection.dissection_settings import DissectionSettings
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.search.behavior_search import SearchStartStates
from pdtui.spectra.monitor import StartState, collect_start_states, walk_lengths

_SHORTEST = 24
_MORE = 4


class ProbeStarts(NamedTuple):
    """Snapshots for each stage; no walk is in two of them.

    Attributes:
        screen, refine: for the sweeps.
        searches: for everything after them.
        plan: the effort, with roll-outs as short as the walks ask for.
        shortened: what was made shorter, as a sentence; empty where nothing was.
    """

    screen: tuple[StartState, ...]
    refine: tuple[StartState, ...]
    searches: SearchStartStates
    plan: DissectionSettings
    shortened: str


def gather_probe_starts(crew: RolloutPool, plan: DissectionSettings, first_seed: int) -> ProbeStarts:
    """One snapshot a walk, from walks that go on for as long as the longest roll-out from there.

    Where too few of them do (a hopper that falls after two seconds), starts and roll-outs become as short as
    it takes: what a unit does within a second is still worth knowing.

    Raises:
        RobotError: the walks are too short even for that.
    """
    counts = (
        plan.screen_starts,
        plan.refine_starts,
        plan.search_starts,
        plan.selection_starts,
        plan.held_out_starts,
    )
    total, wanted, shortened = sum(counts), plan.walk_steps + plan.longest_rollout, ""
    seeds = range(first_seed, first_seed + _MORE * total)
    lengths = walk_lengths(crew.robot, crew.policy, seeds, wanted, enough=total)
    lasting = sorted(lengths, reverse=True)[total - 1]
    if lasting < wanted:
        plan = plan.shortened_to(lasting)
        if plan.longest_rollout < _SHORTEST:
            raise RobotError(
                f"{crew.robot.name}: expected {total} walks of at least {wanted} steps without a fall among "
                f"{len(seeds)} seeds, or shorter ones to make do with, but that many last {lasting} steps "
                "only; dissection needs a policy that stays up for a while"
            )
        shortened = (
            f"Of {len(seeds)} walks, {sum(length >= wanted for length in lengths)} lasted the {wanted} steps "
            f"asked for and {total} lasted {lasting}, so stimulation began at step {plan.walk_steps} and "
            f"lasted at most {plan.longest_rollout} steps. Effects beyond that were not measured."
        )
    everything = collect_start_states(
        crew.robot, crew.policy, first_seed, total, at=plan.walk_steps, survive=plan.longest_rollout
    )
    pools, taken = [], 0
    for count in counts:
        pools.append(tuple(everything[taken : taken + count]))
        taken += count
    return ProbeStarts(pools[0], pools[1], SearchStartStates(*pools[2:]), plan, shortened)
