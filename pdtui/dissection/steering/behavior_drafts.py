"""Proposes behaviors that move one attribute up or down: by units, or by the strongest other way."""

from __future__ import annotations

from dataclasses import replace

from pdtui.core.attributes import BehaviorAim
from pdtui.dissection.attribute_movers import AttributeMover
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.steering.steering_results import SteeringResult
from pdtui.probing.intervention_rollout_plan import InterventionRolloutPlan
from pdtui.stimulation.interventions.intervention import LayerVectors
from pdtui.stimulation.key_allocator import KeyAllocator
from pdtui.stimulation.stimulation_map import Behavior


def draft_attribute_behaviors(
    dissection: Dissection, taken_keys: set[str]
) -> tuple[list[Behavior], list[LayerVectors]]:
    """Return up and down for every attribute that no goal moves that way, as long as keys are free.

    Where no unit was confirmed to move an attribute, the strongest direction, affine edit or imprint that
    steers it without a fall takes its place.

    Args:
        dissection: What was found.
        taken_keys: Keys of other behaviors.

    Returns:
        The behaviors, and the vectors that their interventions name.
    """
    aimed = {(one.goal.aim.attribute, one.goal.aim.sign) for one in dissection.behaviors if one.reached}
    movers = {(one.column, one.sign): one for one in dissection.attribute_movers}
    keys, behaviors, vectors = KeyAllocator(taken_keys), list[Behavior](), list[LayerVectors]()
    for column in dissection.movable:
        attribute, pair = dissection.attributes[column].name, None
        for sign in (1, -1):
            found = movers.get((column, sign)) or _strongest_other_way(dissection, column, sign)
            if found is None or (attribute, sign) in aimed:
                continue
            pair = pair or keys.take_key_pair(attribute)
            if pair is None:
                break
            name = f"{attribute} {'up' if sign > 0 else 'down'}"
            own, further = _draft_behavior(found, dissection, name, pair[0 if sign > 0 else 1])
            behaviors.append(own)
            vectors += further
    return behaviors, vectors


def _strongest_other_way(dissection: Dissection, column: int, sign: int) -> SteeringResult | None:
    ways = [
        one
        for one in dissection.steering.results
        if (one.column, one.sign) == (column, sign)
        and one.beats_baseline
        and not one.measured.falls
        and one.p_random is not None
        and isinstance(one.candidate.plan, InterventionRolloutPlan)
    ]
    return max(ways, key=lambda one: one.main, default=None)


def _draft_behavior(
    found: AttributeMover | SteeringResult, dissection: Dissection, name: str, key: str
) -> tuple[Behavior, list[LayerVectors]]:
    attribute, up = dissection.attributes[found.column].name, found.sign > 0
    aim = BehaviorAim(attribute, "raise" if up else "lower")
    says, verb = "", "raises" if up else "lowers"
    if isinstance(found, AttributeMover):
        if found.alone is not None:
            says = (
                f"; the second unit reduces side effects from {found.alone:.2g} to {found.side:.2g} standard "
                "deviations"
            )
        units = found.stimulation.by_address(dissection.layers)
        return Behavior(name, key, f"{verb} {attribute}{says}", units, aim=aim, measured=found.measured), []
    plan = found.candidate.plan
    assert isinstance(plan, InterventionRolloutPlan)
    renamed = {one.name: f"{name}: {one.name}" for one in plan.vectors}
    own = plan.intervention
    intervention = replace(
        own,
        vectors=renamed.get(own.vectors, ""),
        readout=renamed.get(own.readout, ""),
        bias=renamed.get(own.bias, ""),
    )
    says = f"{verb} {attribute}: {found.method}, {found.candidate.source}, {found.candidate.dose:+g}"
    behavior = Behavior(name, key, says, {}, aim=aim, measured=found.measured, interventions=(intervention,))
    return behavior, [replace(one, name=renamed[one.name]) for one in plan.vectors]
