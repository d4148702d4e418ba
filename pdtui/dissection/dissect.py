"""The whole method, from a weights file to behaviors that were measured."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from pdtui.dissection.confirm import draw_controls, select_units
from pdtui.dissection.effort import Effort
from pdtui.dissection.excerpt import excerpt
from pdtui.dissection.findings import Dissection
from pdtui.dissection.journal import Journal
from pdtui.dissection.matching import match
from pdtui.dissection.monitor import Progress, monitor
from pdtui.dissection.phase import correlate
from pdtui.dissection.probe import Prober
from pdtui.dissection.searches import Clock, Searches
from pdtui.dissection.settings import find_preset
from pdtui.dissection.starts import gather
from pdtui.dissection.steer import movable, steer
from pdtui.dissection.workers import Crew
from pdtui.policies.choices import NO_CHOICES, PolicyChoices
from pdtui.policies.runtime import Policy
from pdtui.policies.units import Stimulation, parse_unit
from pdtui.robots.base import Robot
from pdtui.sessions.versions import environment_versions
from pdtui.stimulation.maps import StimulationMap

StageProgress = Callable[[str, int, int], None]


def dissect(
    robot: str | Robot,
    policy: str | Path | Policy,
    *,
    choices: PolicyChoices = NO_CHOICES,
    preset: str = "paper",
    settings: Sequence[str] = (),
    episodes: int = 5,
    seed: int = 1000,
    budget_minutes: float | None = None,
    workers: int = 2,
    effort: Effort | None = None,
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
        choices: what the weights file leaves open.
        preset: ``paper`` or ``authors``.
        settings: choices of the preset to change, ``NAME=VALUE`` each; see `pdtui.dissection.settings`.
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
    spectrum, plan, began = find_preset(preset, settings), effort or Effort(), time.monotonic()

    def stage(name: str) -> Progress | None:
        return None if progress is None else lambda done, of: progress(name, done, of)

    with Crew(robot, policy, workers, choices) as crew, ExitStack() as stack:
        remembered = None
        if journal is not None:
            remembered = stack.enter_context(Journal(journal, _identity(crew)))
        world, network, prober = crew.robot, crew.policy, Prober(crew, remembered)
        known = _behaviors_of(start_from, network) if start_from is not None else ()
        recorded = monitor(world, network, range(seed, seed + episodes), plan.steps, stage("monitor"))
        matching = match(recorded, world.attributes, spectrum)
        phase = correlate(recorded, world.attributes, spectrum)
        starts = gather(crew, plan, seed + 100)
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
        columns = movable(world.attributes, recorded)
        steered = steer(
            prober,
            columns,
            spread,
            screen,
            refined,
            starts.searches.held_out,
            plan,
            stage("up and down"),
        )
        searches = Searches(prober, world, plan, seed, Clock(began, budget_minutes), stage, known)
        behaviors, holds = searches.run(screen, refined, starts.searches)
        if remembered is not None:
            remembered.remove()
        return Dissection(
            robot=robot if isinstance(robot, str) else robot.name,
            policy=policy.name if isinstance(policy, Policy) else str(policy),
            policy_hash=network.sha256,
            layers=network.layers,
            attributes=world.attributes,
            dt=world.control_dt,
            preset=spectrum,
            seed=seed,
            matching=matching,
            phase=phase,
            excerpt=excerpt(recorded, world.attributes, matching, spectrum),
            screen=screen,
            refined=refined,
            controls=controls,
            spread=spread,
            movable=tuple(columns),
            steered=steered,
            behaviors=behaviors,
            holds=holds,
            rollouts=crew.rollouts,
            control_steps=crew.steps_run,
            minutes=(time.monotonic() - began) / 60,
            choices=choices,
            shortened=starts.shortened,
        )


def _identity(crew: Crew) -> str:
    """What a roll-out's outcome depends on besides its start and plan."""
    return json.dumps([crew.robot.name, crew.policy.sha256, environment_versions()])


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
