"""Measures one policy of the matching study: whether it walks, how its units match, and what they do."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.outcome import count_failures
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.dissection.attribute_movers import movable_attribute_columns
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.policy_evaluation import evaluate_policy
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.rollout_journal import RolloutJournal
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.unit_selection import sample_control_units
from pdtui.sessions.environment_versions import collect_versions
from pdtui.spectra.episode_monitor import MonitoredEpisode, monitor_episodes
from pdtui.spectra.matching import UnitDiscrepancies, match_units
from pdtui.spectra.phase_correlation import correlate_phases
from pdtui.stimulation.map_library import map_without_behaviors
from pdtui.study.matching.matching_study_plan import MatchingStudyPlan, MatchingStudySettings, StudiedPolicy
from pdtui.study.matching.study_data import NO_RANK, ROLES, MatchingStudyData, MeasuredUnits, PolicyFacts

PartProgress = Callable[[str, int, int], None]


def measure_studied_policy(
    plan: MatchingStudyPlan,
    policy: StudiedPolicy,
    weights: Path,
    journal: Path,
    *,
    workers: Workers = 1,
    progress: PartProgress | None = None,
) -> MatchingStudyData:
    """Measure one policy by a plan. Roll-outs that the journal holds are not run again.

    Raises:
        PdtuiError: The robot or the weights cannot be loaded, or its walks are too short to be probed.
    """

    def stage(name: str) -> StepProgress | None:
        return None if progress is None else lambda done, total: progress(name, done, total)

    rule, settings = plan.walking, plan.settings
    drive = DriveConfig(policy.robot, map_without_behaviors(policy.robot, str(weights)), 0, str(weights))
    score = evaluate_policy(drive, rule.seeds, steps=rule.steps, progress=stage("walk"))
    failures, speed = count_failures(score.outcomes) / len(rule.seeds), score.net_speed or 0.0
    walks = speed >= rule.least_speed.get(policy.robot, 0.0) and failures <= rule.most_failures
    with RolloutPool(policy.robot, weights, workers) as pool, ExitStack() as stack:
        facts = PolicyFacts(
            policy.name,
            policy.setting,
            policy.command("FOLDER"),
            policy.kind,
            pool.policy.sha256,
            score.mean_return,
            speed,
            failures,
            walks,
        )
        if not walks:
            return MatchingStudyData(plan, (facts,), ())
        identity = json.dumps([policy.robot, pool.policy.sha256, collect_versions()])
        prober = EffectProbe(pool, stack.enter_context(RolloutJournal(journal, identity)))
        episodes = monitor_episodes(
            pool.robot, pool.policy, settings.monitored, settings.monitored_steps, stage("monitor")
        )
        matchings = {
            name: match_units(episodes, pool.robot.attributes, preset)
            for name, preset in plan.variants.items()
        }
        columns = movable_attribute_columns(pool.robot.attributes, episodes)
        roles = choose_studied_units(settings, pool.policy.units, matchings, columns)
        units = tuple(roles)
        choosing = _probe(prober, units, settings, False, stage("probe to choose"))
        held_out = _probe(prober, units, settings, True, stage("probe on held-out starts"))
        measured = summarize_measured_units(
            plan, policy.name, episodes, pool, matchings, columns, roles, (choosing, held_out)
        )
        counted = replace(facts, units=pool.policy.units, rollouts=pool.rollouts)
        return MatchingStudyData(plan, (counted,), measured)


def choose_studied_units(
    settings: MatchingStudySettings,
    units: int,
    matchings: Mapping[str, UnitDiscrepancies],
    columns: Sequence[int],
) -> dict[int, int]:
    """Return the units to probe in order, each with the index of its role in `ROLES`.

    They are those drawn at random, and the best matches of every attribute in every variant. A unit that is
    drawn keeps its role if it matches, too.
    """
    wanted = settings.reference_units + settings.random_units
    drawn = np.random.default_rng(settings.seed).permutation(
        sample_control_units(range(units), wanted, settings.seed)
    )
    share = round(len(drawn) * settings.reference_units / wanted)
    roles = {int(unit): ROLES.index("reference" if n < share else "random") for n, unit in enumerate(drawn)}
    for matching in matchings.values():
        for column in columns:
            for unit in matching.ranked_units(column)[: settings.best].tolist():
                roles.setdefault(unit, ROLES.index("matched"))
    return dict(sorted(roles.items()))


def _probe(
    prober: EffectProbe,
    units: tuple[int, ...],
    settings: MatchingStudySettings,
    held_out: bool,
    progress: StepProgress | None,
) -> UnitEffects:
    first, count = (
        (settings.held_out_seed, settings.held_out_starts)
        if held_out
        else (settings.choosing_seed, settings.choosing_starts)
    )
    pool = prober.pool
    starts = collect_start_states(pool.robot, pool.policy, first, count, at=settings.start_steps)
    return prober.measure_units(
        units, settings.values, starts, steps=settings.probed_steps, progress=progress
    )


def summarize_measured_units(
    plan: MatchingStudyPlan,
    name: str,
    episodes: Sequence[MonitoredEpisode],
    pool: RolloutPool,
    matchings: Mapping[str, UnitDiscrepancies],
    columns: Sequence[int],
    roles: Mapping[int, int],
    probed: tuple[UnitEffects, UnitEffects],
) -> tuple[MeasuredUnits, ...]:
    """Return what the data keep of each attribute: effects in standard deviations, ranks and correlations."""
    units = np.array(list(roles), np.intp)
    spread = np.concatenate([episode.attributes for episode in episodes]).std(axis=0)
    phases = {
        variant: correlate_phases(episodes, pool.robot.attributes, preset).rho(preset)
        for variant, preset in plan.variants.items()
    }
    choosing, held_out = (one.counted_effects() / spread for one in probed)
    half = held_out.shape[2] // 2
    groups: list[Floats] = [choosing, held_out[:, :, :half], held_out[:, :, half:]]
    means = np.array([group.mean(axis=2) for group in groups])  # shape (groups, N, values, J)

    def ranks(variant: str, column: int) -> np.ndarray[tuple[int], np.dtype[np.uint16]]:
        places = np.full(pool.policy.units, NO_RANK, np.uint16)
        order = matchings[variant].ranked_units(column)
        places[order] = np.arange(len(order))
        return places[units]

    return tuple(
        MeasuredUnits(
            name,
            pool.robot.attributes[column].name,
            units.astype(np.uint16),
            np.array(list(roles.values()), np.uint8),
            means[..., column].transpose(0, 2, 1),
            np.array([ranks(variant, column) for variant in plan.variants]),
            np.array([phases[variant][column, units] for variant in plan.variants]),
        )
        for column in columns
    )
