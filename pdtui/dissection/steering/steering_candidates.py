"""What can be done to hidden units to move an attribute, by one method or another, each at several doses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.units import Stimulation, format_unit
from pdtui.dissection.steering.linear_probes import LinearProbe
from pdtui.dissection.steering.observation_edit_directions import ObservationEditDirection
from pdtui.probing.intervention_rollout_plan import InterventionRolloutPlan
from pdtui.probing.stimulated_rollout import RolloutPlan
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors

_EDIT_SIZES = {"m": 0.05, "rad": 0.2, "m/s": 0.5, "rad/s": 0.25}
"""Smallest size of an edit of the observation that is tried, by its unit."""
_OTHER_EDIT_SIZE = 0.25
_LEAST_ALIGNMENT = 0.05
"""Least cosine between a probe's weights and the difference of means along which an affine edit writes."""


class SteeringMethod(StrEnum):
    """A way to steer an attribute through hidden units."""

    MATCHED_UNIT = "matched unit"
    PROBED_UNIT = "probed unit"
    TWO_UNITS = "two units"
    DIRECTION = "direction"
    AFFINE = "affine"
    IMPRINT = "imprint"
    EDIT_DIRECTION = "edit's direction"
    RANDOM_UNIT = "random unit"
    RANDOM_DIRECTION = "random direction"

    @property
    def baseline(self) -> SteeringMethod:
        """What it is compared with: the best of a few of its kind that were drawn at random."""
        units = SteeringMethod.MATCHED_UNIT, SteeringMethod.PROBED_UNIT, SteeringMethod.TWO_UNITS
        return SteeringMethod.RANDOM_UNIT if self in units else SteeringMethod.RANDOM_DIRECTION


BASELINES = (SteeringMethod.RANDOM_UNIT, SteeringMethod.RANDOM_DIRECTION)
"""Methods that look at nothing."""


@dataclass(frozen=True)
class SteeringCandidate:
    """One thing at one dose.

    Attributes:
        method: The method that it comes from.
        column: Column of the attribute that it is for; None if it is tried for every attribute.
        source: What is dosed, such as ``0:12`` or ``probe of layer 0``.
        dose: Its dose with a sign, in the source's own measure.
        plan: The roll-out.
    """

    method: SteeringMethod
    column: int | None
    source: str
    dose: float
    plan: RolloutPlan


def unit_candidates(
    method: SteeringMethod,
    column: int | None,
    units: Sequence[int],
    values: Sequence[float],
    layers: Sequence[int],
) -> list[SteeringCandidate]:
    """Return single units, each overwritten by each of the values."""
    return [
        SteeringCandidate(method, column, format_unit(unit, layers), value, Stimulation((unit,), (value,)))
        for unit in units
        for value in values
    ]


def pair_candidates(
    column: int, units: Sequence[tuple[int, float]], values: Sequence[float], layers: Sequence[int]
) -> list[SteeringCandidate]:
    """Return the pairs of units, overwritten together by ± each value.

    Args:
        column: Column of the attribute.
        units: Flat indices of units that move the attribute the same way, and the sign of that output.
        values: Outputs, in size.
    """
    found = []
    for number, (first, one) in enumerate(units):
        for second, other in units[number + 1 :]:
            source = " and ".join(
                f"{'−' if sign < 0 else ''}{format_unit(unit, layers)}"
                for unit, sign in ((first, one), (second, other))
            )
            for value in values:
                plan = Stimulation.of(dict(sorted({first: one * value, second: other * value}.items())))
                found.append(SteeringCandidate(SteeringMethod.TWO_UNITS, column, source, value, plan))
    return found


def direction_candidates(probe: LinearProbe, doses: Sequence[float]) -> list[SteeringCandidate]:
    """Return additions along a probe's weights, and along its difference of means.

    Args:
        probe: The probe.
        doses: Lengths of what is added, in the layer's own spread.
    """
    found = []
    for name, vector in (("probe", probe.weights), ("mean difference", probe.mean_difference)):
        found += _added(
            SteeringMethod.DIRECTION, probe.column, probe.layer, name, vector, probe.layer_spread, doses
        )
    return found


def random_direction_candidates(
    layer: int, width: int, spread: float, count: int, doses: Sequence[float], rng: np.random.Generator
) -> list[SteeringCandidate]:
    """Return additions along directions drawn at random, as long as those of `direction_candidates`."""
    found = []
    for number, vector in enumerate(rng.normal(size=(count, width)), start=1):
        name = f"random direction {number}"
        found += _added(SteeringMethod.RANDOM_DIRECTION, None, layer, name, vector, spread, doses)
    return found


def affine_candidates(probe: LinearProbe, doses: Sequence[float]) -> list[SteeringCandidate]:
    """Return edits that set what a probe reads, by moving the layer along the difference of means.

    Args:
        probe: The probe.
        doses: Readings to set, in standard deviations of the attribute from its mean.
    """
    weights, along = probe.weights, probe.mean_difference
    reach = float(weights @ along)
    if reach <= _LEAST_ALIGNMENT * float(np.linalg.norm(weights) * np.linalg.norm(along)):
        return []
    write, found = along / reach, []
    for dose in doses:
        reading = probe.mean + dose * probe.deviation
        vectors = (
            _layer_vectors("write", probe.layer, -write),
            _layer_vectors("read", probe.layer, weights),
            _layer_vectors("bias", probe.layer, write * (reading - probe.intercept)),
        )
        edit = Intervention("affine", vectors="write", readout="read", bias="bias")
        source = f"reading of layer {probe.layer}"
        plan = InterventionRolloutPlan(edit, vectors)
        found.append(SteeringCandidate(SteeringMethod.AFFINE, probe.column, source, dose, plan))
    return found


def observation_edit_candidates(
    edits: Sequence[ObservationEdit], factors: Sequence[float]
) -> list[SteeringCandidate]:
    """Return imprints of the whole first layer, for each edit that the robot offers."""
    found = []
    for edit in edits:
        for factor in factors:
            size = factor * smallest_tried_edit_size(edit)
            plan = InterventionRolloutPlan(Intervention("imprint", values={edit.name: size}, units=("0:*",)))
            found.append(SteeringCandidate(SteeringMethod.IMPRINT, None, edit.name, size, plan))
    return found


def smallest_tried_edit_size(edit: ObservationEdit) -> float:
    """Return the smallest size of an edit of the observation that is tried."""
    return _EDIT_SIZES.get(edit.unit, _OTHER_EDIT_SIZE)


def edit_direction_candidates(
    edits: Sequence[ObservationEdit],
    directions: Mapping[str, ObservationEditDirection],
    factors: Sequence[float],
) -> list[SteeringCandidate]:
    """Return additions along the directions of edits, at the sizes of `observation_edit_candidates`.

    Args:
        edits: The robot's edits of its observation.
        directions: Directions of edits of the smallest size, by name.
        factors: Factors on that size.
    """
    found = []
    for edit in edits:
        direction = directions[edit.name]
        if direction.length == 0.0:
            continue
        vectors = (direction.make_layer_vectors("along"),)
        for factor in factors:
            size = factor * smallest_tried_edit_size(edit)
            plan = InterventionRolloutPlan(direction.make_intervention("along", factor), vectors)
            found.append(SteeringCandidate(SteeringMethod.EDIT_DIRECTION, None, edit.name, size, plan))
    return found


def _added(
    method: SteeringMethod,
    column: int | None,
    layer: int,
    name: str,
    vector: Floats,
    spread: float,
    doses: Sequence[float],
) -> list[SteeringCandidate]:
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        return []
    vectors = (_layer_vectors("along", layer, vector / length),)
    return [
        SteeringCandidate(
            method,
            column,
            f"{name} of layer {layer}",
            dose,
            InterventionRolloutPlan(
                Intervention("direction", vectors="along", coordinates=(dose * spread,)), vectors
            ),
        )
        for dose in doses
    ]


def _layer_vectors(name: str, layer: int, vector: Floats) -> LayerVectors:
    return LayerVectors(name, str(layer), vector[None].astype(np.float32))
