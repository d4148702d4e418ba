"""Interventions bound to a policy's layers and a robot, which make the edits of each control step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, attribute_column
from pdtui.core.errors import MapError, PolicyError
from pdtui.core.units import UnitEdit, parse_unit, split_flat_index
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.stimulation.interventions.gait_clock import GaitClock, GaitMark
from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors
from pdtui.stimulation.interventions.unit_edits import (
    AddAffine,
    AddToUnits,
    ClampUnits,
    ImprintUnits,
    OverwriteUnits,
    ScaleUnits,
    SetCoordinates,
)

# Makes the edits of a step at a strength, some seconds after the behavior began, a share of which is left.
_MakeEdits = Callable[[float, float, float], tuple[UnitEdit, ...]]


class BoundIntervention:
    """An intervention that is ready to act.

    Args:
        intervention: The intervention.
        make: Makes the edits of a control step at a strength that is not 0.
        column: Column of the attribute of its range gate.
        dt: Duration of a control step, s.
    """

    def __init__(self, intervention: Intervention, make: _MakeEdits, column: int, dt: float) -> None:
        self._intervention, self._make, self._column, self._dt = intervention, make, column, dt
        self.units = tuple(unit for one in make(1.0, 0.0, 1.0) for unit in one.units.tolist())
        """Flat indices of the units that it can change."""

    def make_edits(
        self,
        strength: float,
        age: int,
        attributes: Floats,
        clocks: Mapping[GaitMark, GaitClock],
        share: float = 1.0,
    ) -> tuple[UnitEdit, ...]:
        """Return the edits of a control step; none while a gate is closed.

        Args:
            strength: Product of the operator's factor and the controller's output.
            age: Control steps since the behavior began.
            attributes: The robot's present attributes, shape (J,).
            clocks: The moments of the gait that the map's behaviors follow.
            share: How much of it is left while it fades, 1 to 0.
        """
        gate = self._gate(age, attributes, clocks)
        # An imprint of size 0 is one, too: it shows the network the world as it is, or as its base says.
        if gate == 0.0 or (strength == 0.0 and self._intervention.kind != "imprint"):
            return ()
        return self._make(gate * strength, age * self._dt, share)

    def _gate(self, age: int, attributes: Floats, clocks: Mapping[GaitMark, GaitClock]) -> float:
        one, gate = self._intervention, 1.0
        if one.phase_gate is not None:
            gate *= one.phase_gate.factor(clocks[one.phase_gate.mark].phase)
        if one.range_gate is not None:
            gate *= one.range_gate.factor(float(attributes[self._column]))
        if one.time_gate is not None:
            gate *= one.time_gate.factor(age * self._dt)
        return gate


def bind_intervention(
    intervention: Intervention,
    layers: Sequence[int],
    vectors: Mapping[str, LayerVectors],
    observation_edits: Sequence[ObservationEdit],
    attributes: tuple[Attribute, ...],
    dt: float,
    owner: str,
) -> BoundIntervention:
    """Bind an intervention.

    Args:
        intervention: The intervention.
        layers: Widths of the policy's hidden layers.
        vectors: The map's vectors by name.
        observation_edits: The edits that the robot offers of its observation.
        attributes: The robot's attributes.
        dt: Duration of a control step, s.
        owner: Name of the behavior in messages.

    Raises:
        PolicyError: A unit does not exist, or vectors do not fit their layer.
        MapError: The robot has no such edit of its observation.
        RobotError: The robot has no attribute that a gate names.
    """
    gate = intervention.range_gate
    column = 0 if gate is None else attribute_column(gate.attribute, attributes, owner)
    match intervention.kind:
        case "overwrite" | "add" | "scale":
            make: _MakeEdits = partial(
                _edit_units, intervention, _group_by_layer(intervention.values, layers)
            )
        case "clamp":
            make = _bind_clamp(intervention, layers)
        case "direction":
            make = _bind_direction(intervention, layers, vectors, owner)
        case "affine":
            make = _bind_affine(intervention, layers, vectors, owner)
        case "imprint":
            make = _bind_imprint(intervention, layers, observation_edits, owner)
    return BoundIntervention(intervention, make, column, dt)


def overwrite_by_layer(values: Mapping[int, float], layers: Sequence[int]) -> list[UnitEdit]:
    """Return the edits that overwrite units, by flat index, with outputs v."""
    return [
        OverwriteUnits(np.array(units), np.array([values[unit] for unit in units]))
        for units in _split_by_layer(values, layers)
    ]


def _split_by_layer(units: Iterable[int], layers: Sequence[int]) -> list[list[int]]:
    groups: dict[int, list[int]] = {}
    for unit in units:
        groups.setdefault(split_flat_index(unit, layers)[0], []).append(unit)
    return [group for _, group in sorted(groups.items())]


def _group_by_layer(
    values: Mapping[str, float], layers: Sequence[int]
) -> list[tuple[NDArray[np.int64], Floats]]:
    """Return the units of each layer and their values, each shape (n,)."""
    flat = {parse_unit(address, layers): value for address, value in values.items()}
    return [
        (np.array(units, np.int64), np.array([flat[unit] for unit in units]))
        for units in _split_by_layer(flat, layers)
    ]


def _edit_units(
    intervention: Intervention,
    groups: Sequence[tuple[NDArray[np.int64], Floats]],
    strength: float,
    _: float,
    share: float,
) -> tuple[UnitEdit, ...]:
    strength *= share
    if intervention.kind == "overwrite":
        return tuple(OverwriteUnits(units, strength * values) for units, values in groups)
    if intervention.kind == "add":
        return tuple(AddToUnits(units, strength * values) for units, values in groups)
    return tuple(ScaleUnits(units, 1.0 + strength * (values - 1.0)) for units, values in groups)


def _bind_clamp(intervention: Intervention, layers: Sequence[int]) -> _MakeEdits:
    ranges = {parse_unit(unit, layers): ends for unit, ends in intervention.ranges.items()}
    edits = []
    for units in _split_by_layer(ranges, layers):
        low, high = np.array([ranges[unit] for unit in units]).T
        edits.append(ClampUnits(np.array(units), low, high))
    return lambda _strength, _seconds, _share: tuple(edits)


def _layer_units(
    name: str, layers: Sequence[int], vectors: Mapping[str, LayerVectors], owner: str
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return the units of the layer of named vectors, and the vectors, shape (k, n)."""
    found = vectors[name]
    first = parse_unit(f"{found.layer}:0", layers)
    width = layers[split_flat_index(first, layers)[0]]
    if found.rows.shape[1] != width:
        raise PolicyError(
            f"{owner}: vectors '{name}': expected the {width} numbers of layer {found.layer}, "
            f"found {found.rows.shape[1]}"
        )
    return np.arange(first, first + width), found.rows


def _bind_direction(
    intervention: Intervention, layers: Sequence[int], vectors: Mapping[str, LayerVectors], owner: str
) -> _MakeEdits:
    units, rows = _layer_units(intervention.vectors, layers, vectors, owner)
    coordinates = np.array(intervention.coordinates)
    if intervention.sets_coordinates:
        return lambda strength, _, share: (SetCoordinates(units, rows, share * strength * coordinates),)
    added = coordinates @ rows
    return lambda strength, _, share: (AddToUnits(units, share * strength * added),)


def _bind_affine(
    intervention: Intervention, layers: Sequence[int], vectors: Mapping[str, LayerVectors], owner: str
) -> _MakeEdits:
    units, write = _layer_units(intervention.vectors, layers, vectors, owner)
    read_units, read = _layer_units(intervention.readout, layers, vectors, owner)
    bias = np.zeros(len(units), np.float32)
    if intervention.bias:
        bias_units, (bias, *_) = _layer_units(intervention.bias, layers, vectors, owner)
        if bias_units[0] != units[0]:
            raise PolicyError(f"{owner}: '{intervention.bias}' is of another layer than the rest of the edit")
    if read_units[0] != units[0] or len(read) != len(write):
        raise PolicyError(
            f"{owner}: '{intervention.readout}': expected {len(write)} vectors of the layer of "
            f"'{intervention.vectors}'"
        )
    return lambda strength, _, share: (AddAffine(units, write, read, bias, share * strength),)


def _bind_imprint(
    intervention: Intervention, layers: Sequence[int], offered: Sequence[ObservationEdit], owner: str
) -> _MakeEdits:
    by_name = {one.name: one for one in offered}
    names = list({**intervention.values, **intervention.rates, **intervention.base})
    for name in names:
        if name not in by_name:
            known = f"available: {', '.join(by_name)}" if by_name else "it has none"
            raise MapError(f"{owner}: the robot has no edit '{name}' of its observation; {known}")
    addresses: dict[str, float] = {}
    for address in intervention.units:
        layer, _, index = address.rpartition(":")
        if index == "*":
            first = parse_unit(f"{layer}:0", layers)
            width = layers[split_flat_index(first, layers)[0]]
            addresses |= {f"{layer}:{unit}": 0.0 for unit in range(width)}
        else:
            addresses[address] = 0.0
    groups = [units for units, _ in _group_by_layer(addresses, layers)]

    def edit_observation(observation: Floats, strength: float, seconds: float, share: float) -> Floats:
        for name in names:
            grown = intervention.values.get(name, 0.0) + seconds * intervention.rates.get(name, 0.0)
            size = intervention.base.get(name, 0.0) + strength * grown
            if share < 1.0:  # the shorter way back
                size = share * by_name[name].wrap_size(size)
            observation = by_name[name].apply(observation, size)
        return observation

    def make_edits(strength: float, seconds: float, share: float) -> tuple[UnitEdit, ...]:
        edit = partial(edit_observation, strength=strength, seconds=seconds, share=share)
        return tuple(ImprintUnits(units, edit) for units in groups)

    return make_edits
