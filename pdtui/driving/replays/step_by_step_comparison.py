"""The session of a replay that is watched, with which each step is compared as soon as it was run."""

from __future__ import annotations

from pdtui.core.drive_events import DriveEvent, group_events_by_step
from pdtui.core.errors import SessionError
from pdtui.core.step_record import StepRecord
from pdtui.driving.replays.replay_comparison import ReplayComparison, describe_info_differences
from pdtui.driving.session_replay import REQUIRED_STEPS
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.environment_versions import collect_versions, list_version_differences
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.streams.step_block_reader import read_step_blocks

_READ_AT_ONCE = 128
"""Control steps per block. Reading a large block would delay the next control step visibly."""


class StepByStepComparison:
    """Compares control steps one by one, in all streams.

    On the machine and with the versions that recorded the session, every bit has to be the same. Elsewhere,
    only what rounding cannot explain counts as a difference, as in `replay_session`.

    Args:
        header: the header of the session.
        info: what is known about the drive here.

    Raises:
        SessionError: robot or policy are not as the session describes them, or the file is damaged.

    Attributes:
        ended: whether the last recorded control step was compared.
    """

    def __init__(self, header: SessionHeader, info: DriveInfo) -> None:
        if different := describe_info_differences(info, header.info, exact=False):
            raise SessionError(f"{header.path}: differs: description: {'; '.join(different)}")
        self._events = group_events_by_step(header.events)
        self._blocks = read_step_blocks(header, activations=True, poses=True, block_steps=_READ_AT_ONCE)
        self._elsewhere = bool(list_version_differences(header.versions, collect_versions(), numeric=True))
        self._comparison = ReplayComparison(header.info, REQUIRED_STEPS if self._elsewhere else 0)
        self._block, self._row = next(self._blocks, None), 0
        self.ended = self._block is None

    @property
    def steps(self) -> int:
        """The number of control steps that were compared."""
        return self._comparison.steps

    def events_before(self, step: int) -> list[DriveEvent]:
        """Return the events that were applied before a control step."""
        return self._events.get(step, [])

    def compare(self, record: StepRecord) -> str:
        """Compare the next control step; return how it differs, or an empty text.

        A step that the session lacks is not compared. A damaged file is a `SessionError`.
        """
        if self._block is None or self._block.steps[self._row] != record.step:
            return ""
        self._comparison.add([record], self._block.part(self._row, self._row + 1))
        self._row += 1
        if self._row == len(self._block):
            self._block, self._row = next(self._blocks, None), 0
            self.ended = self._block is None
        found = self._comparison
        difference = found.beyond_rounding if self._elsewhere else found.difference
        return "" if difference is None else f"step {record.step} differs from the session: {difference}"

    @property
    def verdict(self) -> str:
        """The result in one line, where nothing differs by more than it may."""
        difference = self._comparison.difference
        if difference is None:
            return f"identical, {self.steps} steps"
        return f"bits differ from step {difference.step} on, as elsewhere they may; {self.steps} steps"
