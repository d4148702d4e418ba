"""Compares the control steps of a replay with those of its session, in every stream that is recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.step_record import StepRecord
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.streams.run_deviations import RunDeviationCounter
from pdtui.sessions.streams.step_block import StepBlock, step_block_of_records
from pdtui.sessions.streams.stream_differences import find_first_stream_difference
from pdtui.sessions.streams.value_differences import StreamDifference

STREAM_TOLERANCE = 1e-4
"""Tolerance of all streams but the attributes on another machine, as a share of values beyond ±1.

Between an AMD EPYC and an Intel Xeon, the streams of the shipped samples differ by at most 5e-6 in the first
5 control steps. Activations that were recorded as float16 may differ by the rounding to 11 bits, 2⁻¹⁰.
"""

_LINK_TOLERANCE = 1e-6
_COMPARED = ("robot", "dt", "layers")
"""Parts of the description, besides links and attributes, that a replay does not take from the session."""


class ReplayComparison:
    """Compares a replay with its session, block by block.

    Args:
        info: the session's drive.
        judged: number of first control steps that must be within the tolerances on another machine.

    Attributes:
        steps: number of control steps that were compared.
        difference: the first value that differs in any bit; None if none does.
        beyond_rounding: the first value that differs by more than rounding can explain, in the judged steps
            and as long as the state of the simulator is the same; None if none does.
        first_digest: the first control step whose digest differs; None if none does.
        rows_before: number of control steps before the first difference.
        deviations: how far attributes are off from the first difference on.
    """

    def __init__(self, info: DriveInfo, judged: int) -> None:
        self._info, self._judged = info, judged
        self.steps = self.rows_before = 0
        self.difference: StreamDifference | None = None
        self.beyond_rounding: StreamDifference | None = None
        self.first_digest: int | None = None
        self.deviations = RunDeviationCounter(info.attributes)

    def add(self, records: Sequence[StepRecord], recorded: StepBlock) -> None:
        """Compare control steps with the same steps of the session."""
        if not records:
            return
        here = step_block_of_records(records, self._info, recorded.pose_steps)
        self.deviations.add_spread(here.attributes, recorded.attributes)
        first = 0
        if self.difference is None:
            self.difference = find_first_stream_difference(here, recorded, self._info)
            if self.difference is None:
                first = len(here)
            else:
                first = int(np.searchsorted(here.steps, self.difference.step))
            self.rows_before += first
        if first < len(here):
            self._judge(here, recorded)
            self.deviations.add(
                here.steps[first:].tolist(), here.attributes[first:], recorded.attributes[first:]
            )
        self.steps += len(here)

    def _judge(self, here: StepBlock, recorded: StepBlock) -> None:
        wrong = np.flatnonzero(here.digests != recorded.digests)
        same = 0 if self.first_digest is not None else int(wrong[0]) if wrong.size else len(here)
        if self.first_digest is None and wrong.size:
            self.first_digest = int(here.steps[wrong[0]])
        until = max(same, min(self._judged - self.steps, len(here)))
        if self.beyond_rounding is None and until > 0:
            self.beyond_rounding = find_first_stream_difference(
                here.part(0, until), recorded.part(0, until), self._info, STREAM_TOLERANCE
            )


def describe_info_differences(here: DriveInfo, recorded: DriveInfo, *, exact: bool) -> tuple[str, ...]:
    """Return in words what differs between a robot and a session's description of it.

    Unless it is to be exact, sizes and places of links may differ by rounding.
    """
    lines = [
        f"{name} is {getattr(here, name)}, recorded {getattr(recorded, name)}"
        for name in _COMPARED
        if getattr(here, name) != getattr(recorded, name)
    ]
    if here.attributes != recorded.attributes:
        lines.append("the robot has other attributes than the session")
    if len(here.links) != len(recorded.links):
        lines.append(f"the robot has {len(here.links)} links, recorded {len(recorded.links)}")
    tolerance = 0.0 if exact else _LINK_TOLERANCE
    for one, other in zip(here.links, recorded.links, strict=False):
        named = (one.name, one.body, one.shape) == (other.name, other.body, other.shape)
        near = named and np.allclose(
            (*one.size, *one.position, *one.quaternion),
            (*other.size, *other.position, *other.quaternion),
            rtol=tolerance,
            atol=tolerance,
        )
        if not near:
            lines.append(f"link '{one.name}' is not the recorded one")
            break
    return tuple(lines)
