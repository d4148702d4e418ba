"""The whole method, from a policy to behaviors that were measured."""

from __future__ import annotations

import json
import time
from contextlib import ExitStack
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from torch import nn

from pdtui.core.errors import RobotError
from pdtui.core.units import Stimulation, parse_unit
from pdtui.core.worker_pool import StepProgress
from pdtui.dissection.attribute_movers import find_attribute_movers, movable_attribute_columns
from pdtui.dissection.dissection_config import DissectionConfig, DissectionSettings
from pdtui.dissection.dissection_result import Dissection, pick_sample_episode
from pdtui.dissection.dissection_searches import DissectionSearches
from pdtui.policies.runtime.live_network import policy_from_network
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.primitive_confirmation import sample_control_units, select_units_to_refine
from pdtui.probing.rollout_journal import RolloutJournal
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states, measure_walk_lengths
from pdtui.robots import open_robot
from pdtui.search.behavior_search import SearchStartStates
from pdtui.search.plan_search import SharedTimeBudget
from pdtui.sessions.environment_versions import collect_versions
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset
from pdtui.spectra.phase_correlation import correlate_phases
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stimulation_map import StimulationMap

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


def dissect(config: DissectionConfig) -> Dissection:
    """Dissect a policy: monitor it, match and probe its units, and search for behaviors.

    Raises:
        PdtuiError: The robot, the policy, the preset or the map to start from cannot be had, or the policy
            falls too often to be dissected.
    """
    if isinstance(config.policy, nn.Module):
        with open_robot(config.robot) as robot:
            policy = policy_from_network(config.policy, robot.observation_space, robot.action_space)
            return dissect(replace(config, robot=robot, policy=policy))
    began, seed, settings = time.monotonic(), config.seed, config.settings
    preset = find_matching_preset(config.preset, config.preset_changes)
    first_map = config.start_from
    if isinstance(first_map, str | Path):
        first_map = load_map(find_map(str(first_map)))

    def stage(name: str) -> StepProgress | None:
        report = config.progress
        return None if report is None else lambda done, total: report(name, done, total)

    pool = RolloutPool(config.robot, config.policy, config.workers, config.import_options)
    with pool, ExitStack() as stack:
        robot, network, journal = pool.robot, pool.policy, None
        if config.journal is not None:
            # What the outcome of a roll-out depends on besides its start and plan.
            identity = json.dumps([robot.name, network.sha256, collect_versions()])
            journal = stack.enter_context(RolloutJournal(config.journal, identity))
        prober = EffectProbe(pool, journal)
        known = _fixed_behaviors(first_map, network) if first_map is not None else ()
        episodes = monitor_episodes(
            robot, network, range(seed, seed + config.episodes), settings.steps, stage("monitor")
        )
        matching = match_units(episodes, robot.attributes, preset)
        phase = correlate_phases(episodes, robot.attributes, preset)
        starts = gather_probe_starts(pool, settings, seed + 100)
        settings = starts.settings
        screen = prober.measure_units(
            range(network.units),
            settings.screen_values,
            starts.screen,
            steps=settings.screen_steps,
            progress=stage("screen every unit"),
        )
        chosen = select_units_to_refine(screen, matching, range(len(robot.attributes)), settings.refine_keep)
        controls = sample_control_units(screen, settings.controls, seed)
        refined = prober.measure_units(
            sorted({*chosen, *controls}),
            settings.refine_values,
            starts.refine,
            steps=settings.refine_steps,
            progress=stage("refine the best"),
        )
        spread = np.concatenate([episode.attributes for episode in episodes]).std(axis=0)
        columns = movable_attribute_columns(robot.attributes, episodes)
        movers = find_attribute_movers(
            prober, columns, spread, screen, refined, starts.searches.held_out, settings, stage("up and down")
        )
        searches = DissectionSearches(
            prober, robot, settings, seed, SharedTimeBudget(config.budget_minutes, began), stage, known
        )
        behaviors, controllers = searches.run(screen, refined, starts.searches)
        return Dissection(
            robot=config.robot if isinstance(config.robot, str) else robot.name,
            policy=network.name if isinstance(config.policy, Policy) else str(config.policy),
            policy_hash=network.sha256,
            layers=network.layers,
            attributes=robot.attributes,
            goals=robot.goals,
            dt=robot.control_dt,
            preset=preset,
            seed=seed,
            matching=matching,
            phase=phase,
            sample_episode=pick_sample_episode(episodes, robot.attributes, matching, preset),
            screen=screen,
            refined=refined,
            controls=controls,
            spread=spread,
            movable=tuple(columns),
            attribute_movers=movers,
            behaviors=behaviors,
            controllers=controllers,
            rollouts=pool.rollouts,
            control_steps=pool.control_steps,
            minutes=(time.monotonic() - began) / 60,
            import_options=config.import_options,
            shortened=starts.shortened,
        )


def _fixed_behaviors(stimulation_map: StimulationMap, policy: Policy) -> tuple[Stimulation, ...]:
    """Return what the map's behaviors of fixed magnitude overwrite.

    Raises:
        MapError: A unit does not exist in the policy.
    """
    stimulation_map.check(stimulation_map.robot, policy.layers, policy.sha256, force=True)
    fixed = [one for one in stimulation_map.behaviors.values() if one.pid is None]
    units = [stimulation_map.units_of(one).items() for one in fixed]
    return tuple(Stimulation.of({parse_unit(unit, policy.layers): v for unit, v in one}) for one in units)


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
                f"{len(seeds)} walks, the best {total} last {lasting} steps; dissection needs a policy that "
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
