"""From a dissection to a stimulation-evoked map, as text to be read and edited."""

from __future__ import annotations

import numpy as np

from pdtui.core.units import Stimulation, describe_units, format_unit
from pdtui.dissection.dissection_config import SEEDS_PER_DISSECTION
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.search_task_into_map import draft_task_behavior
from pdtui.dissection.steering.behavior_drafts import draft_attribute_behaviors
from pdtui.robots.robot_goals import HoldBehaviorGoal
from pdtui.search.behavior_search import BehaviorSearchResult
from pdtui.search.controller_search import ControllerSearchResult
from pdtui.search.task_search import TaskSearchResult
from pdtui.stimulation.map_writer import compose_map
from pdtui.stimulation.seed_ranges import merge_seed_ranges
from pdtui.stimulation.stimulation_map import Behavior, MotorPrimitive, PidGains, StimulationMap

_MIN_RHO = 0.1
"""Below, ``v = c ρ`` would need a huge magnitude c: such a behavior names the unit instead."""

_LEAST_DONE = 0.5
"""Share of the held-out walks on which a task must be done for its behavior to enter the map."""


def draft_map(dissection: Dissection) -> str:
    """Return the map that a dissection proposes, as TOML.

    The primitive of an attribute is the confirmed unit of the largest effect. Attributes get one if the
    robot's goals name them; if the robot has none of those, every attribute that can be moved gets one.
    A behavior that did not reach its goal on the held-out starts is left out, and a comment says how far it
    came.
    """
    primitives = _draft_primitives(dissection)
    names = {one.unit: one for one in primitives if abs(one.rho) >= _MIN_RHO}
    behaviors = [_draft_behavior(found, dissection, names) for found in dissection.behaviors if found.reached]
    behaviors += [_draft_controller(found, dissection) for found in dissection.controllers if found.holds]
    behaviors += [
        draft_task_behavior(found, dissection.layers, dissection.dt)
        for found in dissection.tasks
        if _does_task(found)
    ]
    further, vectors = draft_attribute_behaviors(dissection, {one.key for one in behaviors})
    behaviors += further
    stimulation_map = StimulationMap(
        dissection.robot,
        dissection.policy,
        dissection.policy_hash,
        "space",
        {one.name: one for one in primitives},
        {one.name: one for one in behaviors},
        source=f"dissection of {dissection.policy}",
        import_options=dissection.import_options,
        seeds=merge_seed_ranges(
            [
                range(dissection.seed, dissection.seed + SEEDS_PER_DISSECTION),
                *(seeds for found in dissection.tasks for seeds in found.seeds),
            ]
        ),
        robot_options=dict(dissection.robot_options),
        vectors={one.name: one for one in vectors},
    )
    return compose_map(stimulation_map, _comments(dissection, {one.attribute for one in primitives}))


def _comments(dissection: Dissection, confirmed: set[str]) -> list[str]:
    lines = [
        f"Proposed by dissecting {dissection.policy_hash[:12]}… with preset '{dissection.preset}' and "
        f"seed {dissection.seed}: {dissection.rollouts} roll-outs.",
        "Effects are changes against the unperturbed roll-out, with 95 % intervals over starting states.",
    ]
    if dissection.shortened:
        lines.append(dissection.shortened)
    missing = [attribute for attribute in _primitive_names(dissection) if attribute not in confirmed]
    if missing:
        lines.append(f"No unit was confirmed for: {', '.join(missing)}.")
    for behavior in dissection.behaviors:
        if not behavior.reached:
            best = describe_units(behavior.stimulation.by_address(dissection.layers))
            line = (
                f"Not found: {behavior.goal.name}. The best stimulation, {best}, reached the goal on "
                f"{behavior.success:.0%} of the held-out starts and fell on {behavior.falls:.0%}."
            )
            if behavior.reliable:
                line += (
                    " The best of as many random sets of units did about as well: its gain is "
                    f"{behavior.rival_gain:.2g} beside {behavior.gain.effect:.2g} (p {behavior.rival_p:.2g})."
                )
            lines.append(line)
    for task in dissection.tasks:
        if not _does_task(task):
            lines.append(
                f"Not found: {task.task.name}. The best stimulation did it on {task.done} of "
                f"{len(task.verdicts)} held-out walks, and none on {task.done_without}."
            )
    for controller in dissection.controllers:
        if not controller.holds:
            lines.append(
                f"Not found: {_hold_goal(controller, dissection).name}. The best controller is off by "
                f"{controller.error:.2f} (by {controller.uncontrolled:.2f} without it) and fell on "
                f"{controller.falls:.0%}."
            )
    return lines


def _does_task(found: TaskSearchResult) -> bool:
    return found.done > found.done_without and found.done >= _LEAST_DONE * len(found.verdicts)


def _draft_primitives(dissection: Dissection) -> list[MotorPrimitive]:
    primitives = []
    for attribute, name in _primitive_names(dissection).items():
        column = dissection.column(attribute)
        best_units = dissection.judgment.of_attribute(column)
        # Without a phase there is no ρ, and without ρ no magnitude c: such a unit is no primitive.
        rho = dissection.phase.rho(dissection.preset)[column]
        best = next((one for one in best_units if one.confirmed and np.isfinite(rho[one.unit])), None)
        if best is not None:
            discrepancy = float(dissection.matching.discrepancy[column, best.unit])
            primitives.append(
                MotorPrimitive(
                    name,
                    attribute,
                    format_unit(best.unit, dissection.layers),
                    round(float(rho[best.unit]), 4),
                    float(f"{discrepancy:.4g}") if np.isfinite(discrepancy) else None,
                    best.verdict.value,
                    best.verdict.measured,
                )
            )
    return primitives


def _primitive_names(dissection: Dissection) -> dict[str, str]:
    """Return the attributes that get a primitive, and the primitive's name."""
    names = [attribute.name for attribute in dissection.attributes]
    usual = {attribute: name for attribute, name in dissection.goals.primitives.items() if attribute in names}
    return usual or {names[column]: names[column] for column in dissection.movable}


def _draft_behavior(
    found: BehaviorSearchResult, dissection: Dissection, primitives: dict[str, MotorPrimitive]
) -> Behavior:
    magnitudes: dict[str, float] = {}
    for address, value in found.stimulation.by_address(dissection.layers).items():
        if address in primitives:
            magnitudes[primitives[address].name] = float(f"{value / primitives[address].rho:.8g}")
        else:
            magnitudes[address] = value
    goal = found.goal
    return Behavior(goal.name, goal.key, goal.says, magnitudes, aim=goal.aim, measured=found.change)


def _draft_controller(found: ControllerSearchResult, dissection: Dissection) -> Behavior:
    goal, layers = _hold_goal(found, dissection), dissection.layers
    pid = found.pid
    gains = (float(f"{number:.4g}") for number in (pid.kp, pid.ki, pid.kd, pid.limit, pid.step))
    return Behavior(
        goal.name,
        goal.key,
        goal.says,
        # By address even where a primitive has the unit: the controller was measured with these very weights.
        found.weights.by_address(layers),
        Stimulation(found.weights.units, found.base).by_address(layers) if found.base else {},
        mode="pid",
        pid=PidGains(pid.attribute, *gains),
    )


def _hold_goal(found: ControllerSearchResult, dissection: Dissection) -> HoldBehaviorGoal:
    return next(goal for goal in dissection.goals.holds if goal.attribute == found.pid.attribute)
