"""The latest control steps of a run, which can be looked at again, and the events of all of them."""

from __future__ import annotations

from array import array
from collections import deque
from typing import NamedTuple

from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord

MOST_BYTES = 48 << 20
"""Memory of the steps that are kept: of the Ant, ten minutes."""
_OVERHEAD = 1024  # bytes of a record besides its arrays


class PastStep(NamedTuple):
    """A control step, and what had been counted up to its end: steps with a key, arrivals and cost."""

    record: StepRecord
    involvement: int
    arrivals: int
    cost: float

    @property
    def bytes(self) -> int:
        """Memory that it takes, roughly."""
        record = self.record
        arrays = (record.activations, record.attributes, record.poses, record.action)
        return _OVERHEAD + sum(array.nbytes for array in arrays)


class PastSteps:
    """The latest control steps, as many as `MOST_BYTES` hold.

    A moment is named by the number of control steps that had been done.

    Attributes:
        events: all events of the run, by the control step before which they applied.
        digests: digests of the simulator's state after each control step of the run.
    """

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._kept: deque[PastStep] = deque()
        self._bytes, self._most_bytes = 0, most_bytes
        self.events: dict[int, tuple[DriveEvent, ...]] = {}
        self.digests = array("q")

    def add(self, record: StepRecord) -> None:
        """Keep a control step, and forget the oldest ones for which there is no more room."""
        _, involvement, arrivals, cost = self._kept[-1] if self._kept else (None, 0, 0, 0.0)
        arrived = record.outcome is Outcome.ARRIVED
        step = PastStep(record, involvement + record.involved, arrivals + arrived, cost + record.cost)
        self._kept.append(step)
        self._bytes += step.bytes
        while self._bytes > self._most_bytes and len(self._kept) > 1:
            self._bytes -= self._kept.popleft().bytes
        self.digests.append(record.digest)
        if record.events:
            self.events[record.step] = record.events

    @property
    def oldest(self) -> int:
        """The earliest moment that can be looked at; 0 before the first control step."""
        return self._kept[0].record.step + 1 if self._kept else 0

    def find(self, moment: int) -> PastStep:
        """Return the control step that led to a moment, `oldest` or later."""
        return self._kept[moment - self.oldest]

    def latest_stretch(self, moment: int, most: int) -> list[StepRecord]:
        """Return at most so many control steps up to a moment, without a jump or an ending between."""
        stretch: list[StepRecord] = []
        for number in range(moment, max(self.oldest, moment - most + 1, 1) - 1, -1):
            record = self.find(number).record
            if stretch and record.episode != stretch[-1].episode:
                break
            stretch.append(record)
            if any(event.jumps for event in record.events):
                break
        return stretch[::-1]
