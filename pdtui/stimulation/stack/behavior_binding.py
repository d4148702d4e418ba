"""Binds the behaviors of a map to a policy's layers and to a robot."""

from __future__ import annotations

from pdtui.core.attributes import Attribute, attribute_column
from pdtui.core.units import parse_unit
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.stimulation.interventions.bound_intervention import bind_intervention
from pdtui.stimulation.latched_behavior import LatchedBehavior
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

NOT_YET = -1
"""Control steps that an armed behavior waits, while that cannot be known."""


def bind_behavior(
    behavior: Behavior,
    stimulation_map: StimulationMap,
    layers: tuple[int, ...],
    attributes: tuple[Attribute, ...],
    dt: float,
    observation_edits: tuple[ObservationEdit, ...],
) -> LatchedBehavior:
    """Return a behavior of a map as it is when its key is pressed; a latch latches copies of it.

    Raises:
        PolicyError: A unit of the behavior does not exist.
        RobotError: The robot has no attribute that it is to hold, or to wait for.
        MapError: The robot has no edit of its observation that an imprint needs.
    """
    owner = f"{stimulation_map.source}: behavior '{behavior.name}'"
    weights, base = (
        {parse_unit(unit, layers): value for unit, value in outputs.items()}
        for outputs in (stimulation_map.units_of(behavior), behavior.base)
    )
    column = 0 if behavior.pid is None else attribute_column(behavior.pid.attribute, attributes, owner)
    steps = None if behavior.period is None else max(1, round(behavior.period / dt))
    bound = tuple(
        bind_intervention(one, layers, stimulation_map.vectors, observation_edits, attributes, dt, owner)
        for one in behavior.interventions
    )
    return LatchedBehavior(
        behavior, weights, base, bound, column, steps, None if behavior.onset is None else NOT_YET
    )
