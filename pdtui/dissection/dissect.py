"""The whole method, from a weights file to behaviors that were measured."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pdtui.dissection.combine import Found, Search, Sizes, Starts
from pdtui.dissection.confirm import select_units
from pdtui.dissection.goals import goals_for
from pdtui.dissection.hold import Aimed, Held, HoldSearch, HoldSizes
from pdtui.dissection.matching import Match, match
from pdtui.dissection.monitor import Progress, Start, collect_starts, monitor
from pdtui.dissection.phase import Phase, correlate
from pdtui.dissection.probe import Prober, Sweep
from pdtui.dissection.spectrum import Preset, find_preset
from pdtui.dissection.workers import Crew
from pdtui.robots.base import Robot
from pdtui.robots.types import Attribute, column_of

StageProgress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Effort:
    """How much a dissection does; the defaults are for ten to fifteen minutes on two idle cores.

    Attributes:
        steps: control steps of a monitored episode.
        screen_values, screen_starts, screen_steps: every unit at these outputs, from so many starts.
        refine_keep: units kept from screening for each attribute and direction.
        refine_values, refine_starts, refine_steps: those units again, from other starts.
        search_starts, selection_starts, held_out_starts: of the search for behaviors.
        walk: control steps between a reset and a start.
        search, hold: sizes of the searches.
    """

    steps: int = 1000
    screen_values: tuple[float, ...] = (-4.0, -2.0, 2.0, 4.0)
    screen_starts: int = 2
    screen_steps: int = 60
    refine_keep: int = 2
    refine_values: tuple[float, ...] = (-8.0, -4.0, -2.0, 0.0, 2.0, 4.0, 8.0)
    refine_starts: int = 6
    refine_steps: int = 80
    search_starts: int = 10
    selection_starts: int = 12
    held_out_starts: int = 16
    walk: int = 100
    search: Sizes = field(default_factory=Sizes)
    hold: HoldSizes = field(default_factory=HoldSizes)


@dataclass(frozen=True)
class Dissection:
    """Everything that was found about one policy.

    Attributes:
        robot: name of the robot.
        policy: name or path as given.
        policy_hash: SHA-256 of the weights.
        layers: widths of the hidden layers.
        attributes: of the robot.
        dt: s per control step.
        preset: of the spectra.
        seed: everything random came from it.
        matching: discrepancies.
        phase: correlations.
        screen: every unit, at a few values.
        refined: the best of them and the first matches, from other starts.
        behaviors: the best stimulation for each goal.
        holds: the best controllers.
        rollouts, control_steps, minutes: what it took.
    """

    robot: str
    policy: str
    policy_hash: str
    layers: tuple[int, ...]
    attributes: tuple[Attribute, ...]
    dt: float
    preset: Preset
    seed: int
    matching: Match
    phase: Phase
    screen: Sweep
    refined: Sweep
    behaviors: tuple[Found, ...]
    holds: tuple[Held, ...]
    rollouts: int
    control_steps: int
    minutes: float

    def column(self, attribute: str) -> int:
        """Column of an attribute.

        Raises:
            RobotError: the robot has no such attribute.
        """
        return column_of(attribute, self.attributes, self.robot)


def dissect(
    robot: str,
    policy: str | Path,
    *,
    preset: str = "paper",
    episodes: int = 5,
    seed: int = 1000,
    budget_minutes: float | None = None,
    workers: int = 2,
    effort: Effort | None = None,
    progress: StageProgress | None = None,
) -> Dissection:
    """Dissect a policy: monitor, match, probe, and search for behaviors.

    With no time budget the result depends only on the arguments, not on the machine's speed or the number of
    workers. Monitored episodes take the seeds from `seed` on, starts those from ``seed + 100`` on.

    Args:
        robot: name of the robot.
        policy: weights file or name of a shipped policy.
        preset: ``paper`` or ``authors``.
        episodes: monitored (the paper: 5).
        seed: of everything.
        budget_minutes: the searches end, with the best so far, when this is over; screening always completes.
        workers: processes.
        effort: how much to do.
        progress: called with (stage, done, of).

    Raises:
        PdtuiError: an unknown robot, policy or preset, or a policy that falls too often to be dissected.
    """
    spectrum, plan, began = find_preset(preset), effort or Effort(), time.monotonic()

    def stage(name: str) -> Progress | None:
        return None if progress is None else lambda done, of: progress(name, done, of)

    with Crew(robot, policy, workers) as crew:
        world, network, prober = crew.robot, crew.policy, Prober(crew)
        recorded = monitor(world, network, range(seed, seed + episodes), plan.steps, stage("monitor"))
        matching = match(recorded, world.attributes, spectrum)
        phase = correlate(recorded, world.attributes, spectrum)
        pools = _starts(crew, plan, seed + 100)
        screen = prober.sweep(
            range(network.units),
            plan.screen_values,
            pools[0],
            steps=plan.screen_steps,
            progress=stage("screen every unit"),
        )
        chosen = select_units(screen, matching, range(len(world.attributes)), plan.refine_keep)
        refined = prober.sweep(
            chosen,
            plan.refine_values,
            pools[1],
            steps=plan.refine_steps,
            progress=stage("refine the best"),
        )
        starts = Starts(*pools[2:])
        searches = _Searches(prober, world, plan, seed, _Clock(began, budget_minutes), stage)
        behaviors = searches.behaviors((screen, refined), starts)
        holds = searches.holds(refined, starts)
        return Dissection(
            robot=robot,
            policy=str(policy),
            policy_hash=network.sha256,
            layers=network.layers,
            attributes=world.attributes,
            dt=world.control_dt,
            preset=spectrum,
            seed=seed,
            matching=matching,
            phase=phase,
            screen=screen,
            refined=refined,
            behaviors=behaviors,
            holds=holds,
            rollouts=crew.rollouts,
            control_steps=crew.steps_run,
            minutes=(time.monotonic() - began) / 60,
        )


def _starts(crew: Crew, plan: Effort, first_seed: int) -> list[tuple[Start, ...]]:
    """Snapshots for screening, refining, search, selection and held-out, from one walk each."""
    counts = (
        plan.screen_starts,
        plan.refine_starts,
        plan.search_starts,
        plan.selection_starts,
        plan.held_out_starts,
    )
    survive = max(plan.screen_steps, plan.refine_steps, plan.search.final_steps, plan.hold.final_steps)
    everything = collect_starts(
        crew.robot, crew.policy, first_seed, sum(counts), at=plan.walk, survive=survive
    )
    pools, taken = [], 0
    for count in counts:
        pools.append(tuple(everything[taken : taken + count]))
        taken += count
    return pools


class _Clock:
    """Shares what is left of a time budget fairly among the searches to come."""

    def __init__(self, began: float, minutes: float | None) -> None:
        self._end = None if minutes is None else began + 60 * minutes

    def share(self, left: int) -> Callable[[], bool]:
        """Whether the next search's part of the time is over, when `left` searches are still to run."""
        if self._end is None:
            return lambda: False
        now = time.monotonic()
        until = now + max(0.0, self._end - now) / max(1, left)
        return lambda: time.monotonic() >= until


@dataclass(frozen=True)
class _Searches:
    prober: Prober
    world: Robot
    plan: Effort
    seed: int
    clock: _Clock
    stage: Callable[[str], Progress | None]

    def behaviors(self, sweeps: Sequence[Sweep], starts: Starts) -> tuple[Found, ...]:
        goals = goals_for(self.world.attributes)
        found = []
        for number, goal in enumerate(goals):
            column = self.world.attribute_index(goal.aim.attribute)
            search = Search(self.prober, goal, column, starts, self.seed + number, self.plan.search)
            deadline = self.clock.share(len(goals) - number + 2)
            found.append(search.run(sweeps, deadline, self.stage(f"search: {goal.name}")))
        return tuple(found)

    def holds(self, sweep: Sweep, starts: Starts) -> tuple[Held, ...]:
        usual = 0.0
        names = [attribute.name for attribute in self.world.attributes]
        if "speed" in names:
            usual = float(np.mean(sweep.unperturbed[:, names.index("speed")]))
        asked = (
            Aimed("yaw", (-0.8, -0.4, 0.4, 0.8), True),
            Aimed("speed", (0.4 * usual, 0.7 * usual), False),
        )
        wanted = [target for target in asked if target.attribute in names]
        held = []
        for number, target in enumerate(wanted):
            column, deadline = names.index(target.attribute), self.clock.share(len(wanted) - number)
            search, held_out = starts.search[:3], (*starts.selection[:4], *starts.held_out[:4])
            searcher = HoldSearch(self.prober, target, self.plan.hold)
            held.append(searcher.run(sweep, column, search, held_out, deadline))
            progress = self.stage(f"search: hold {target.attribute}")
            if progress is not None:
                progress(1, 1)
        return tuple(one for one in held if one is not None)
