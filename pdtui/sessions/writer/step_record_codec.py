"""Control steps as bytes, for the process that records them.

The format is internal to two processes of one program and never stored: both come from the same code.
"""

from __future__ import annotations

import pickle
from dataclasses import fields
from operator import attrgetter
from typing import Any

import numpy as np

from pdtui.core.outcome import Outcome
from pdtui.core.scenery import NO_SCENERY, NO_TRAFFIC, Scenery
from pdtui.core.step_record import ActiveBehavior, ReplacedAction, StepRecord
from pdtui.core.units import NO_STIMULATION, Stimulation

_Layout = tuple[tuple[str, tuple[int, ...]], ...]
_behavior_values = attrgetter(*(field.name for field in fields(ActiveBehavior)))


class StepRecordEncoder:
    """Encodes control steps one after the other.

    What seldom changes, the layout of the arrays and the scenery, is encoded only when it does. Arrays and
    data classes are taken apart, because to pickle them takes ten times as long.
    """

    def __init__(self) -> None:
        self._layout: Any = None
        self._scenery: Scenery = NO_SCENERY

    def encode(self, record: StepRecord) -> bytes:
        """Return the bytes of a control step."""
        arrays = record.action, record.activations, record.attributes, record.poses
        layout = tuple([(array.dtype, array.shape) for array in arrays])
        changed: _Layout | None = None
        if layout != self._layout:
            self._layout = layout
            changed = tuple((dtype.str, shape) for dtype, shape in layout)
        scenery = None
        if record.scenery is not self._scenery:
            self._scenery = scenery = record.scenery
        stimulation = record.stimulation
        values = (
            (record.step, record.episode, record.reward, record.cost, record.digest),
            record.ended,
            None if record.outcome is None else record.outcome.value,
            (record.natural, (stimulation.units, stimulation.values) if stimulation.units else None),
            [_behavior_values(behavior) for behavior in record.behaviors],
            [tuple(replaced) for replaced in record.replaced],
            record.events,
            (None if record.traffic is NO_TRAFFIC else record.traffic, scenery),
            changed,
            [array.tobytes() for array in arrays],
        )
        return pickle.dumps(values, pickle.HIGHEST_PROTOCOL)


class StepRecordDecoder:
    """Decodes control steps in the order in which they were encoded."""

    def __init__(self) -> None:
        self._layout: _Layout = ()
        self._scenery: Scenery = NO_SCENERY

    def decode(self, data: bytes) -> StepRecord:
        """Return the control step; its arrays cannot be written to."""
        numbers, ended, outcome, stimulated, behaviors, replaced, events, seen, layout, arrays = pickle.loads(
            data
        )
        step, episode, reward, cost, digest = numbers
        natural, stimulation = stimulated
        traffic, scenery = seen
        self._layout = layout or self._layout
        self._scenery = scenery or self._scenery
        action, activations, attributes, poses = (
            np.frombuffer(array, dtype).reshape(shape)
            for array, (dtype, shape) in zip(arrays, self._layout, strict=True)
        )
        return StepRecord(
            step,
            episode,
            events,
            tuple([ActiveBehavior(*values) for values in behaviors]),
            NO_STIMULATION if stimulation is None else Stimulation(*stimulation),
            natural,
            action,
            activations,
            attributes,
            poses,
            reward,
            cost,
            digest,
            ended,
            self._scenery,
            NO_TRAFFIC if traffic is None else traffic,
            None if outcome is None else Outcome(outcome),
            tuple([ReplacedAction(*values) for values in replaced]),
        )
