"""Interventions as fields of a map, as `read_interventions` reads them."""

from __future__ import annotations

import base64
from dataclasses import asdict
from typing import Any

from pdtui.stimulation.interventions.gait_clock import GaitMark
from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors, Onset


def vectors_fields(vectors: LayerVectors) -> dict[str, Any]:
    """Return the fields of vectors."""
    data = base64.b64encode(vectors.rows.astype("<f4").tobytes()).decode("ascii")
    return {"name": vectors.name, "layer": vectors.layer, "count": len(vectors.rows), "data": data}


def onset_fields(onset: Onset) -> dict[str, Any]:
    """Return the fields of an onset."""
    return {**_mark_fields(onset.mark), "delay": onset.delay}


def intervention_fields(one: Intervention) -> dict[str, Any]:
    """Return the fields of an intervention that it uses."""
    fields: dict[str, Any] = {"kind": one.kind}
    for name in (
        "values",
        "base",
        "rates",
        "units",
        "vectors",
        "readout",
        "bias",
        "coordinates",
        "sets_coordinates",
    ):
        if value := getattr(one, name):
            fields[name] = value
    if one.ranges:
        fields["ranges"] = {unit: list(ends) for unit, ends in one.ranges.items()}
    if one.phase_gate is not None:
        fields["phase_gate"] = {**_mark_fields(one.phase_gate.mark), "factors": list(one.phase_gate.factors)}
    if one.range_gate is not None:
        fields["range_gate"] = asdict(one.range_gate)
    if one.time_gate is not None:
        gate = {name: value for name, value in asdict(one.time_gate).items() if value not in (None, False)}
        fields["time_gate"] = {name: _listed(value) for name, value in gate.items()}
    return fields


def _mark_fields(mark: GaitMark) -> dict[str, Any]:
    return {
        "signal": mark.signal,
        "crosses": mark.crosses,
        "level": mark.level,
        "minimum_spacing": mark.minimum_spacing,
    }


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
