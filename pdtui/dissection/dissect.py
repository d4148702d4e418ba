"""The whole method, from a policy to behaviors that were measured."""

from __future__ import annotations

import json
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
from torch import nn

from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import Stimulation, parse_unit
from pdtui.dissection.attribute_movers import find_attribute_movers, movable_attribute_columns
from pdtui.dissection.dissection_config import DissectionConfig
from pdtui.dissection.dissection_result import Dissection, pick_sample_episode
from pdtui.dissection.dissection_searches import DissectionSearches
from pdtui.dissection.primitive_judging import judge_primitives, measure_own_range
from pdtui.dissection.probe_starts import gather_probe_starts
from pdtui.dissection.steering.gather_candidates import fit_edit_directions, gather_steering_candidates
from pdtui.dissection.steering.linear_probes import fit_linear_probes
from pdtui.dissection.steering.steering_comparison import compare_steering
from pdtui.policies.runtime.live_network import policy_from_network
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import NO_OPTIONS
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_journal import RolloutJournal
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.unit_selection import (
    choose_primitive_candidates,
    sample_control_units,
    select_units_to_refine,
)
from pdtui.robots import open_robot
from pdtui.search.evolutionary_search import SharedTimeBudget
from pdtui.sessions.environment_versions import collect_versions
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset
from pdtui.spectra.phase_correlation import correlate_phases
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stimulation_map import StimulationMap


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
        report = config.report
        return None if report is None else lambda done, total: report(name, done, total)

    pool = RolloutPool(config.robot, config.policy, config.workers, config.import_options)
    with pool, ExitStack() as stack:
        robot, network, journal = pool.robot, pool.policy, None
        if config.journal is not None:
            # What the outcome of a roll-out depends on besides its start and plan.
            options: list[object] = [dict(robot.build_options)] if robot.build_options else []
            if config.import_options != NO_OPTIONS:
                options.append(config.import_options.identify())
            identity = json.dumps([robot.name, network.sha256, collect_versions(), *options])
            journal = stack.enter_context(RolloutJournal(config.journal, identity))
        prober = EffectProbe(pool, journal)
        known = _fixed_behaviors(first_map, network) if first_map is not None else ()
        episodes = monitor_episodes(
            robot, network, range(seed, seed + config.episodes), settings.steps, stage("monitor")
        )
        columns = range(len(robot.attributes))
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
        chosen = select_units_to_refine(screen, matching, columns, settings.refine_keep)
        refined = prober.measure_units(
            chosen,
            settings.refine_values,
            starts.refine,
            steps=settings.refine_steps,
            progress=stage("refine the best"),
        )
        judgment = judge_primitives(
            prober,
            robot.attributes,
            choose_primitive_candidates(
                screen, refined, matching, columns, settings.screen_values, settings.judge_keep
            ),
            sample_control_units(screen.units, settings.controls, seed),
            measure_own_range(episodes),
            starts.judge,
            settings,
            seed,
            stage("judge"),
        )
        spread = np.concatenate([episode.attributes for episode in episodes]).std(axis=0)
        movable = movable_attribute_columns(robot.attributes, episodes)
        movers = find_attribute_movers(
            prober,
            movable,
            spread,
            screen,
            refined,
            starts.searches.selection,
            starts.searches.held_out,
            settings,
            stage("up and down"),
        )
        probes = fit_linear_probes(
            episodes, robot.attributes, network.layers, movable, settings.steering.half
        )
        steering = compare_steering(
            prober,
            movable,
            spread,
            gather_steering_candidates(
                matching,
                refined,
                probes,
                robot.observation_edits,
                fit_edit_directions(robot, network, seed),
                network.layers,
                movable,
                settings.steering,
                seed,
            ),
            probes,
            starts.searches.selection[: settings.steering.starts],
            starts.searches.held_out,
            settings.mover_steps,
            settings.level,
            stage("compare ways to steer"),
        )
        searches = DissectionSearches(
            prober, robot, settings, seed, SharedTimeBudget(config.budget_minutes, began), stage, known
        )
        behaviors, controllers = searches.run(screen, refined, starts.searches)
        tasks = searches.search_units_for_tasks(refined.units)
        return Dissection(
            robot=robot.name,
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
            judgment=judgment,
            spread=spread,
            movable=tuple(movable),
            attribute_movers=movers,
            steering=steering,
            behaviors=behaviors,
            controllers=controllers,
            tasks=tasks,
            rollouts=pool.rollouts,
            control_steps=pool.control_steps,
            minutes=(time.monotonic() - began) / 60,
            import_options=config.import_options,
            shortened=starts.shortened,
            robot_options=dict(robot.build_options),
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
