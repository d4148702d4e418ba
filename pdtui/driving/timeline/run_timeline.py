"""Which moment of a run the screen shows, and up to which one the run is hurried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.core.step_record import StepRecord
from pdtui.driving.timeline.past_steps import PastSteps


class RunTimeline:
    """The moments of a run: those past, the present one, and those that are known to come.

    A moment is named by the number of control steps that have been done. Looking at a past one changes
    nothing of the run. What is known to come is the rest of a recording that is watched, or the beginning of
    a branch, which is driven again up to the step at which it branches off.

    Args:
        length: number of control steps of the recording that is watched; 0 for a drive.
        next_events: events of the control steps up to `goal`, by step.
        given_digests: the digests that these steps have to have.
        goal: moment up to which the run goes on without a pace.

    Attributes:
        past: the control steps that can be looked at.
        viewed: the moment that is shown; None for the present.
    """

    def __init__(
        self,
        length: int = 0,
        next_events: Mapping[int, Sequence[DriveEvent]] | None = None,
        given_digests: Sequence[int] = (),
        goal: int = 0,
    ) -> None:
        self.past = PastSteps()
        self.length, self.goal = length, goal
        self._events, self._digests = next_events or {}, given_digests
        self.viewed: int | None = None

    @property
    def present(self) -> int:
        """Number of control steps that have been done."""
        return len(self.past.digests)

    @property
    def moment(self) -> int:
        """The moment that is shown."""
        return self.present if self.viewed is None else self.viewed

    @property
    def runs_unpaced(self) -> bool:
        """Whether the run goes on without a pace."""
        return self.present < self.goal

    @property
    def repeats(self) -> bool:
        """Whether the next control step is one of the beginning of a branch."""
        return self.present < len(self._digests)

    def next_events(self) -> list[DriveEvent]:
        """Return the events of the next control step, which `repeats`."""
        return list(self._events.get(self.present, ()))

    def add_step(self, record: StepRecord) -> None:
        """Add a control step; a `SessionError` says that it `repeats` one, but differs from it."""
        repeats = self.repeats
        self.past.add(record)
        if repeats and record.digest != self._digests[record.step]:
            raise SessionError(
                f"no branch: step {record.step} came out differently when it was driven again; the session "
                "that was to be branched is whole"
            )

    def seek(self, moment: int) -> str:
        """Show a moment, or go on to one that is known to come; return what the user should know."""
        self.goal = 0
        if moment >= self.present:
            self.viewed, self.goal = None, min(moment, self.length)
            return ""
        self.viewed = max(moment, self.past.oldest)
        if not self.past.oldest:
            self.viewed = None
            return "no control step has been done yet"
        if moment < self.viewed and self.past.oldest > 1:
            return f"step {self.viewed} is the oldest that can be looked at"
        return ""

    def play(self) -> bool:
        """Show the next moment of the past; return whether that is the present."""
        assert self.viewed is not None
        self.viewed = None if self.viewed + 1 >= self.present else self.viewed + 1
        return self.viewed is None

    def branch(self) -> RunTimeline:
        """Return the timeline of a branch from the moment that is shown, which has to be driven again."""
        return RunTimeline(
            next_events=self.past.events, given_digests=self.past.digests[: self.moment], goal=self.moment
        )
