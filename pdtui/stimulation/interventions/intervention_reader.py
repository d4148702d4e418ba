"""Reads interventions, their gates and vectors, and onsets from a map."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import cast, get_args

import numpy as np

from pdtui.core.units import ADDRESS
from pdtui.stimulation.interventions.gait_clock import CrossingDirection, GaitMark
from pdtui.stimulation.interventions.intervention import (
    Intervention,
    InterventionKind,
    LayerVectors,
    Onset,
    PhaseGate,
    RangeGate,
    TimeGate,
    orthonormality_error,
)
from pdtui.stimulation.map_table_reader import MapTableReader

_MAX_VECTORS, _MAX_WIDTH = 64, 65_536
# What rounding to float32 may leave of orthonormality.
_TOLERANCE = 1e-3
_MAX_DELAY = 60.0


def read_vectors(table: MapTableReader) -> LayerVectors:
    """Read vectors: a name, a layer, their number, and base64 of little-endian float32 numbers."""
    name, layer = table.text("name"), table.text("layer")
    count, data = table.take("count", int), table.take("data", str)
    try:
        numbers = np.frombuffer(base64.b64decode(data, validate=True), "<f4")
    except (binascii.Error, ValueError) as error:
        raise table.error("data", f"expected base64 of float32 numbers: {error}") from error
    if not 1 <= count <= _MAX_VECTORS:
        raise table.error("count", f"expected 1 to {_MAX_VECTORS}, found {count}")
    if not len(numbers) or len(numbers) % count or len(numbers) > count * _MAX_WIDTH:
        raise table.error("data", f"expected {count} vectors of one length, found {len(numbers)} numbers")
    if not np.isfinite(numbers).all():
        raise table.error("data", "expected finite numbers")
    table.done()
    return LayerVectors(name, layer, numbers.astype(np.float32).reshape(count, -1))


def read_onset(parent: MapTableReader) -> Onset | None:
    """Take the onset of a behavior, if it has one."""
    table = parent.table("onset", None)
    if table is None:
        return None
    mark, delay = _read_mark(table), table.number("delay", 0.0)
    if not 0.0 <= delay <= _MAX_DELAY:
        raise table.error("delay", f"expected 0 to {_MAX_DELAY:g} s, found {delay:g}")
    table.done()
    return Onset(mark, delay)


def read_interventions(
    parent: MapTableReader, vectors: Mapping[str, LayerVectors]
) -> tuple[Intervention, ...]:
    """Take the interventions of a behavior."""
    return tuple(_read_intervention(table, vectors) for table in parent.tables("interventions"))


def _read_intervention(table: MapTableReader, vectors: Mapping[str, LayerVectors]) -> Intervention:
    kind = cast(InterventionKind, table.choice("kind", get_args(InterventionKind)))
    gates = _read_phase_gate(table), _read_range_gate(table), _read_time_gate(table)
    match kind:
        case "overwrite" | "add" | "scale":
            values = table.numbers("values")
            _check_addresses(table, "values", values)
            found = Intervention(kind, values)
        case "clamp":
            found = Intervention(kind, ranges=_read_ranges(table))
        case "direction":
            name = _take_vectors(table, "vectors", vectors)
            coordinates, sets = table.number_list("coordinates"), table.take("sets_coordinates", bool, False)
            rows = vectors[name].rows
            if len(coordinates) != len(rows):
                raise table.error(
                    "coordinates", f"expected {len(rows)}, one per vector, found {len(coordinates)}"
                )
            if sets and orthonormality_error(rows) > _TOLERANCE:
                raise table.error("vectors", f"'{name}': expected orthonormal vectors to set coordinates")
            found = Intervention(kind, vectors=name, coordinates=coordinates, sets_coordinates=sets)
        case "affine":
            write, read = (_take_vectors(table, field, vectors) for field in ("vectors", "readout"))
            bias = _take_vectors(table, "bias", vectors) if table.has("bias") else ""
            if len(vectors[write].rows) != len(vectors[read].rows):
                raise table.error("readout", f"expected as many vectors as '{write}' has")
            found = Intervention(kind, vectors=write, readout=read, bias=bias)
        case "imprint":
            values, base = table.numbers("values", {}), table.numbers("base", {})
            rates = table.numbers("rates", {})
            if not values and not base and not rates:
                raise table.error("values", "expected the size of at least one edit of the observation")
            units = table.texts("units")
            for unit in units:
                if not ADDRESS.fullmatch(unit.removesuffix("*") + "0" if unit.endswith(":*") else unit):
                    raise table.error(
                        "units", f"'{unit}': expected layer:index, or layer:* for all of a layer"
                    )
            if not units:
                raise table.error("units", "expected at least one unit")
            found = Intervention(kind, values, base, rates, units=units)
    table.done()
    return _with_gates(found, *gates)


def _with_gates(
    one: Intervention, phase: PhaseGate | None, range_: RangeGate | None, time: TimeGate | None
) -> Intervention:
    return replace(one, phase_gate=phase, range_gate=range_, time_gate=time)


def _check_addresses(table: MapTableReader, field: str, values: Mapping[str, object]) -> None:
    if not values:
        raise table.error(field, "expected at least one unit")
    for address in values:
        if not ADDRESS.fullmatch(address):
            raise table.error(field, f"'{address}': expected layer:index, such as 0:12")


def _take_vectors(table: MapTableReader, field: str, vectors: Mapping[str, LayerVectors]) -> str:
    name = table.text(field)
    if name not in vectors:
        raise table.error(field, f"no vectors '{name}'; available: {', '.join(vectors) or 'none'}")
    return name


def _read_ranges(table: MapTableReader) -> dict[str, tuple[float, float]]:
    ends = table.table("ranges")
    assert ends is not None
    ranges: dict[str, tuple[float, float]] = {}
    for address in ends.names():
        pair = ends.number_list(address)
        if len(pair) != 2 or pair[0] > pair[1]:
            raise ends.error(address, "expected a low and a high end")
        ranges[address] = pair[0], pair[1]
    _check_addresses(table, "ranges", ranges)
    return ranges


def _read_mark(table: MapTableReader) -> GaitMark:
    crosses = cast(CrossingDirection, table.choice("crosses", get_args(CrossingDirection), "up"))
    minimum_spacing = table.number("minimum_spacing", 0.1)
    if minimum_spacing < 0.0:
        raise table.error("minimum_spacing", f"expected 0 s or more, found {minimum_spacing:g}")
    return GaitMark(table.text("signal"), crosses, table.number("level", 0.0), minimum_spacing)


def _read_phase_gate(parent: MapTableReader) -> PhaseGate | None:
    table = parent.table("phase_gate", None)
    if table is None:
        return None
    gate = PhaseGate(_read_mark(table), table.number_list("factors"))
    if not gate.factors:
        raise table.error("factors", "expected at least one factor")
    table.done()
    return gate


def _read_range_gate(parent: MapTableReader) -> RangeGate | None:
    table = parent.table("range_gate", None)
    if table is None:
        return None
    gate = RangeGate(table.text("attribute"), table.number("low"), table.number("high"))
    if gate.low > gate.high:
        raise table.error("low", f"expected at most {gate.high:g}, found {gate.low:g}")
    table.done()
    return gate


def _read_time_gate(parent: MapTableReader) -> TimeGate | None:
    table = parent.table("time_gate", None)
    if table is None:
        return None
    times, factors = table.number_list("times"), table.number_list("factors")
    repeat, interpolate = table.number("repeat", None), table.take("interpolate", bool, False)
    if not times or times[0] != 0.0 or any(b <= a for a, b in pairwise(times)):
        raise table.error("times", "expected times that increase from 0")
    if len(times) != len(factors):
        raise table.error("factors", f"expected {len(times)}, one per time, found {len(factors)}")
    if repeat is not None and repeat <= times[-1]:
        raise table.error("repeat", f"expected more than {times[-1]:g} s, found {repeat:g}")
    table.done()
    return TimeGate(times, factors, repeat, interpolate)
