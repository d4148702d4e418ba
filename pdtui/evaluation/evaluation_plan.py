"""Which runs an evaluation consists of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import MapError
from pdtui.core.units import Stimulation, parse_unit
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_substitutes import (
    ActionShift,
    BehaviorSubstitute,
    draw_random_direction,
    draw_random_units,
    mean_intervention_size,
)
from pdtui.evaluation.disturbance_conditions import CONDITIONS, UNDISTURBED, find_condition
from pdtui.evaluation.held_run import HeldRunPlan, InterventionMeasurement
from pdtui.evaluation.protocol_settings import ProtocolSettings, RunTimes, plan_run_times
from pdtui.stimulation.stimulation_map import Behavior

SubstituteKind = Literal["units", "random units", "random directions", "actions"]
"""What is pushed; ``units`` are the behavior's own."""
MEASURED_SEEDS = 3
"""Seeds on which it is measured how far a behavior moves units and actions."""


class RunKey(NamedTuple):
    """One run of an evaluation.

    Attributes:
        behavior: The behavior that is pressed; empty for the policy alone.
        seed: Seed of the run.
        condition: Name of the condition.
        kind: What is pushed.
        draw: Number of the draw of a random kind.
    """

    behavior: str
    seed: int
    condition: str = UNDISTURBED.name
    kind: SubstituteKind = "units"
    draw: int = 0


def select_behaviors(config: DriveConfig, names: Sequence[str]) -> DriveConfig:
    """Return a configuration whose map has only the behaviors of these names; no name keeps all.

    Raises:
        MapError: The map has no such behavior.
    """
    known = config.stimulation_map.behaviors
    for name in names:
        if name not in known:
            raise MapError(
                f"{config.stimulation_map.source}: no behavior '{name}'; available: {', '.join(known)}"
            )
    if not names:
        return config
    kept = {name: behavior for name, behavior in known.items() if name in names}
    return replace(config, stimulation_map=replace(config.stimulation_map, behaviors=kept))


@dataclass(frozen=True)
class EvaluationPlan:
    """The runs of an evaluation.

    Attributes:
        loop: Robot, policy and map.
        seeds: The seeds.
        settings: The sizes of the evaluation.
    """

    loop: ControlLoop
    seeds: Sequence[int]
    settings: ProtocolSettings

    @cached_property
    def behaviors(self) -> list[Behavior]:
        """The behaviors with an aim; those of mode ``pid`` have targets instead."""
        return [b for b in self.loop.map.behaviors.values() if b.aim is not None and b.pid is None]

    @cached_property
    def tasked(self) -> list[Behavior]:
        """The behaviors with a task."""
        return [b for b in self.loop.map.behaviors.values() if b.task]

    @cached_property
    def conditions(self) -> list[str]:
        """Names of the conditions that the robot is put in."""
        disturbed = self.settings.condition_seeds > 0
        wanted = [one for one in CONDITIONS if disturbed or one is UNDISTURBED]
        return [one.name for one in wanted if one.is_offered(self.loop.robot)]

    @cached_property
    def not_offered(self) -> tuple[str, ...]:
        """Names of the conditions that the robot cannot be put in."""
        return tuple(one.name for one in CONDITIONS if not one.is_offered(self.loop.robot))

    def outputs(self, behavior: Behavior) -> Stimulation:
        """Return the units that a behavior overwrites."""
        units = self.loop.map.units_of(behavior)
        return Stimulation.of({parse_unit(unit, self.loop.policy.layers): v for unit, v in units.items()})

    def changes_units(self, behavior: Behavior) -> bool:
        """Return whether a behavior does anything to hidden units; one of commands alone does not."""
        return bool(self.outputs(behavior).units or behavior.interventions)

    def seeds_of(self, condition: str) -> Sequence[int]:
        """Return the seeds that are run in a condition."""
        return self.seeds if condition == UNDISTURBED.name else self.seeds[: self.settings.condition_seeds]

    def substitutes_of(self, behavior: Behavior) -> list[tuple[SubstituteKind, int]]:
        """Return the kinds of substitutes of a behavior, and the number of draws of each."""
        draws, constant = self.settings.draws, bool(self.outputs(behavior).units)
        if not draws or not self.changes_units(behavior):
            return []
        # Random units take the behavior's constants, which one of interventions does not have.
        units: list[tuple[SubstituteKind, int]] = [("random units", draws)] if constant else []
        return [*units, ("random directions", draws), ("actions", 1)]

    def held_runs(self) -> list[RunKey]:
        """Return the runs in which a behavior with an aim is held, and those without a press."""
        names = ["", *(b.name for b in self.behaviors)] if self.behaviors else []
        keys = [
            RunKey(name, seed, condition)
            for condition in self.conditions
            for name in names
            for seed in self.seeds_of(condition)
        ]
        keys += [
            RunKey(behavior.name, seed, UNDISTURBED.name, kind, draw)
            for behavior in self.behaviors
            for kind, draws in self.substitutes_of(behavior)
            for draw in range(draws)
            for seed in self.seeds[: self.settings.draw_seeds]
        ]
        return keys

    def measuring_runs(self) -> list[HeldRunPlan]:
        """Return the runs that measure how far behaviors with an aim move units and actions.

        Those without a press measure how far observations spread in a walk from the robot's usual start.
        """
        named = [b.name for b in self.behaviors if self.changes_units(b)]
        names = ["", *named] if self.behaviors or self.tasked else []
        return [
            HeldRunPlan(name, seed, self.times(name, seed))
            for name in names
            for seed in self.seeds[:MEASURED_SEEDS]
        ]

    def times(self, name: str, seed: int) -> RunTimes:
        """Return the times of a run; one without a press lasts as long as the longest with one."""
        dt, known = self.loop.robot.control_dt, self.loop.map.behaviors
        if name:
            return plan_run_times(self.settings, seed, dt, known[name].period)
        whole = plan_run_times(self.settings, seed, dt)
        longest = max((self.times(b.name, seed).steps for b in self.behaviors), default=0)
        return replace(whole, after=max(whole.after, longest - whole.press - whole.held))

    def held_plan(
        self, key: RunKey, measured: Mapping[str, Sequence[InterventionMeasurement]]
    ) -> HeldRunPlan | None:
        """Return what to run for a key.

        Args:
            key: The run.
            measured: What the measuring runs found, by behavior.

        Returns:
            The run; None for a substitute whose size was not measured, because the robot fell before.
        """
        substitute = self.draw_substitute(key.kind, key.behavior, key.draw, measured)
        if key.kind != "units" and substitute is None:
            return None
        return HeldRunPlan(
            key.behavior,
            key.seed,
            self.times(key.behavior, key.seed),
            find_condition(key.condition),
            substitute,
            self.mean_observation_spread(measured),
        )

    def mean_observation_spread(self, measured: Mapping[str, Sequence[InterventionMeasurement]]) -> Floats:
        """Return the standard deviation of every observation in an undisturbed walk."""
        spread: Floats = np.mean([one.observation_spread for one in measured[""]], axis=0)
        return spread

    def draw_substitute(
        self,
        kind: SubstituteKind,
        behavior: str,
        draw: int,
        measured: Mapping[str, Sequence[InterventionMeasurement]],
    ) -> BehaviorSubstitute | None:
        """Return what acts in the place of a behavior's units.

        Args:
            kind: What is pushed.
            behavior: Name of the behavior.
            draw: Number of the draw of a random kind.
            measured: What the measuring runs found, by behavior.

        Returns:
            The substitute; None for the units themselves, and for a size that could not be measured.
        """
        layers = self.loop.policy.layers
        if kind == "units":
            return None
        if kind == "random units":
            return draw_random_units(self.outputs(self.loop.map.behaviors[behavior]), layers, behavior, draw)
        sizes = [one.size for one in measured[behavior] if one.size is not None]
        if not sizes:
            return None
        size = mean_intervention_size(sizes)
        if kind == "actions":
            return ActionShift(size.action)
        return draw_random_direction(size, layers, behavior, draw)
