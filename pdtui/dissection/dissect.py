"""The whole method, from a weights file to behaviors that were measured."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from pdtui.core.units import Stimulation, parse_unit
from pdtui.dissection.attribute_movers import find_attribute_movers, movable_columns
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_searches import DissectionSearches, TimeBudget
from pdtui.dissection.dissection_settings import DissectionSettings
from pdtui.dissection.probe_starts import gather_probe_starts
from pdtui.dissection.sample_episode import pick_sample_episode
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.confirmation import draw_controls, select_units
from pdtui.probing.effect_probe import EffectProber
from pdtui.probing.rollout_journal import RolloutJournal
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots.robot import Robot
from pdtui.sessions.environment_versions import collect_versions
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_preset
from pdtui.spectra.monitor import StepProgress, monitor_episodes
from pdtui.spectra.phase_correlation import correlate_phases
from pdtui.stimulation.stimulation_map import StimulationMap

StageProgress = Callable[[str, int, int], None]


def dissect(
    robot: str | Robot,
    policy: str | Path | Policy,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    preset: str = "paper",
    settings: Sequence[str] = (),
    episodes: int = 5,
    seed: int = 1000,
    budget_minutes: float | None = None,
    workers: int = 2,
    effort: DissectionSettings | None = None,
    progress: StageProgress | None = None,
    journal: Path | None = None,
    start_from: StimulationMap | None = None,
) -> Dissection:
    """Dissect a policy: monitor, match, probe, and search for behaviors.

    With no time budget the result depends only on the arguments, not on the machine's speed or the number of
    workers. Monitored episodes take the seeds from `seed` on, starts those from ``seed + 100`` on.

    Args:
        robot: name of the robot, or a robot.
        policy: weights file, name of a shipped policy, or a policy.
        import_options: what the weights file leaves open.
        preset: ``paper`` or ``authors``.
        settings: choices of the preset to change, ``NAME=VALUE`` each; see `pdtui.spectra.matching_presets`.
        episodes: monitored (the paper: 5).
        seed: of everything.
        budget_minutes: the searches end, with the best so far, when this is over; screening always completes.
        workers: processes; one, this one, where robot or policy is given as an object.
        effort: how much to do.
        progress: called with (stage, done, of).
        journal: remembers roll-outs, so that a run that was interrupted goes on here; removed at the end.
        start_from: a map whose fixed behaviors the searches begin from, too: they can only get better.

    Raises:
        PdtuiError: an unknown robot, policy or preset, or a policy that falls too often to be dissected.
    """
    spectrum, plan, began = find_preset(preset, settings), effort or DissectionSettings(), time.monotonic()

    def stage(name: str) -> StepProgress | None:
        return None if progress is None else lambda done, of: progress(name, done, of)

    with RolloutPool(robot, policy, workers, import_options) as crew, ExitStack() as stack:
        remembered = None
        if journal is not None:
            remembered = stack.enter_context(RolloutJournal(journal, _identity(crew)))
        world, network, prober = crew.robot, crew.policy, EffectProber(crew, remembered)
        known = _behaviors_of(start_from, network) if start_from is not None else ()
        recorded = monitor_episodes(
            world, network, range(seed, seed + episodes), plan.steps, stage("monitor")
        )
        matching = match_units(recorded, world.attributes, spectrum)
        phase = correlate_phases(recorded, world.attributes, spectrum)
        starts = gather_probe_starts(crew, plan, seed + 100)
        plan = starts.plan
        screen = prober.sweep(
            range(network.units),
            plan.screen_values,
            starts.screen,
            steps=plan.screen_steps,
            progress=stage("screen every unit"),
        )
        chosen = select_units(screen, matching, range(len(world.attributes)), plan.refine_keep)
        controls = draw_controls(screen, plan.controls, seed)
        refined = prober.sweep(
            sorted({*chosen, *controls}),
            plan.refine_values,
            starts.refine,
            steps=plan.refine_steps,
            progress=stage("refine the best"),
        )
        spread = np.concatenate([episode.attributes for episode in recorded]).std(axis=0)
        columns = movable_columns(world.attributes, recorded)
        movers = find_attribute_movers(
            prober,
            columns,
            spread,
            screen,
            refined,
            starts.searches.held_out,
            plan,
            stage("up and down"),
        )
        searches = DissectionSearches(
            prober, world, plan, seed, TimeBudget(began, budget_minutes), stage, known
        )
        behaviors, controllers = searches.run(screen, refined, starts.searches)
        if remembered is not None:
            remembered.remove()
        return Dissection(
            robot=robot if isinstance(robot, str) else robot.name,
            policy=policy.name if isinstance(policy, Policy) else str(policy),
            policy_hash=network.sha256,
            layers=network.layers,
            attributes=world.attributes,
            goals=world.goals,
            dt=world.control_dt,
            preset=spectrum,
            seed=seed,
            matching=matching,
            phase=phase,
            sample_episode=pick_sample_episode(recorded, world.attributes, matching, spectrum),
            screen=screen,
            refined=refined,
            controls=controls,
            spread=spread,
            movable=tuple(columns),
            attribute_movers=movers,
            behaviors=behaviors,
            controllers=controllers,
            rollouts=crew.rollouts,
            control_steps=crew.steps_run,
            minutes=(time.monotonic() - began) / 60,
            import_options=import_options,
            shortened=starts.shortened,
        )


def _identity(crew: RolloutPool) -> str:
    """What a roll-out's outcome depends on besides its start and plan."""
    return json.dumps([crew.robot.name, crew.policy.sha256, collect_versions()])


def _behaviors_of(stimulation_map: StimulationMap, policy: Policy) -> tuple[Stimulation, ...]:
    """What the map's behaviors of fixed magnitude overwrite.

    Raises:
        MapError: a unit does not exist in the policy.
    """
    stimulation_map.check(stimulation_map.robot, policy.layers, policy.sha256, force=True)
    return tuple(
        Stimulation.of(
            {parse_unit(unit, policy.layers): v for unit, v in stimulation_map.units_of(behavior).items()}
        )
        for behavior in stimulation_map.behaviors.values()
        if behavior.pid is None
    )
