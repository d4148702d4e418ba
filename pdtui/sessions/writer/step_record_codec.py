"""Control steps as bytes, for the process that records them: JSON, and behind it the arrays as they are.

The format is internal to two processes of one program and never stored.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import fields
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome
from pdtui.core.scenery import NO_SCENERY, NO_TRAFFIC, RoadLine, Scenery, Traffic
from pdtui.core.step_record import ActiveBehavior, ReplacedAction, StepRecord
from pdtui.core.units import NO_STIMULATION, Stimulation

_Array = NDArray[Any]
_LENGTH = 4
_behavior_values = attrgetter(*(field.name for field in fields(ActiveBehavior)))
_event_values = attrgetter(*(field.name for field in fields(DriveEvent)))


class StepRecordEncoder:
    """Encodes control steps one after the other.

    What seldom changes, the layout of the arrays and the scenery, is encoded only when it does.
    """

    def __init__(self) -> None:
        self._layout: Any = None
        self._scenery: Scenery = NO_SCENERY
        # The usual one is made anew with each call of `json.dumps`.
        self._encode = json.JSONEncoder(default=_number).encode

    def encode(self, record: StepRecord) -> bytes:
        """Return the bytes of a control step."""
        arrays: list[_Array] = [record.action, record.activations, record.attributes, record.poses]
        layout, known = _layout(arrays), None
        if layout != self._layout:
            self._layout = known = layout
        traffic = scenery = None
        if record.traffic is not NO_TRAFFIC:
            seen = record.traffic
            own = [seen.identities, seen.poses, seen.sizes, seen.lidar_hits]
            traffic = seen.kinds, _named(own)
            arrays += own
        if record.scenery is not self._scenery:
            self._scenery = record.scenery
            own = [record.scenery.cylinders, *(line.points for line in record.scenery.lines)]
            scenery = [line.kind for line in record.scenery.lines], _named(own)
            arrays += own
        stimulation = record.stimulation
        values = (
            (record.step, record.episode, record.reward, record.cost, record.digest),
            record.ended,
            record.outcome,
            (record.natural, stimulation.units, stimulation.values),
            [_behavior_values(behavior) for behavior in record.behaviors],
            record.replaced,
            [_event_values(event) for event in record.events],
            None if known is None else [(dtype.str, shape) for dtype, shape in known],
            traffic,
            scenery,
        )
        text = self._encode(values).encode()
        return b"".join([len(text).to_bytes(_LENGTH, "little"), text, *[one.tobytes() for one in arrays]])


class StepRecordDecoder:
    """Decodes control steps in the order in which they were encoded."""

    def __init__(self) -> None:
        self._layout: Sequence[Any] = ()
        self._scenery: Scenery = NO_SCENERY

    def decode(self, data: bytes) -> StepRecord:
        """Return the control step; its arrays cannot be written to."""
        end = _LENGTH + int.from_bytes(data[:_LENGTH], "little")
        numbers, ended, outcome, stimulated, behaviors, replaced, events, layout, traffic, scenery = (
            json.loads(data[_LENGTH:end])
        )
        self._layout = layout or self._layout
        named = [*self._layout, *(traffic[1] if traffic else ()), *(scenery[1] if scenery else ())]
        arrays = _read_arrays(data, end, named)
        action, activations, attributes, poses = (next(arrays) for _ in range(4))
        seen = NO_TRAFFIC
        if traffic:
            identities, places, sizes, hits = (next(arrays) for _ in range(4))
            seen = Traffic(identities, tuple(traffic[0]), places, sizes, hits)
        if scenery:
            cylinders = next(arrays)
            lines = tuple(RoadLine(kind, points) for kind, points in zip(scenery[0], arrays, strict=True))
            self._scenery = Scenery(lines, cylinders)
        step, episode, reward, cost, digest = numbers
        natural, units, values = stimulated
        return StepRecord(
            step,
            episode,
            tuple([DriveEvent(*one) for one in events]),
            tuple([ActiveBehavior(*one) for one in behaviors]),
            Stimulation(tuple(units), tuple(values)) if units else NO_STIMULATION,
            tuple(natural),
            action,
            activations,
            attributes,
            poses,
            reward,
            cost,
            digest,
            ended,
            self._scenery,
            seen,
            None if outcome is None else Outcome(outcome),
            tuple([ReplacedAction(*one) for one in replaced]),
        )


def _layout(arrays: Sequence[_Array]) -> list[tuple[np.dtype[Any], tuple[int, ...]]]:
    return [(array.dtype, array.shape) for array in arrays]


def _named(arrays: Sequence[_Array]) -> list[tuple[str, tuple[int, ...]]]:
    return [(array.dtype.str, array.shape) for array in arrays]


def _read_arrays(data: bytes, place: int, named: Sequence[Any]) -> Iterator[_Array]:
    for dtype, shape in named:
        array: _Array = np.ndarray(shape, dtype, data, place)
        place += array.nbytes
        yield array


def _number(value: Any) -> Any:
    """Return the plain number that a NumPy scalar stands for."""
    return value.item()
