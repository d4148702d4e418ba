"""The drive's side of its ghost: when it begins and ends, and which steps both have done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.closable import Closable
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import PdtuiError
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost.ghost_process import GhostProcess
from pdtui.driving.ghost.ghost_simulation import GhostStart, GhostStepResult
from pdtui.driving.ghost.ghost_snapshot import GhostPose, GhostSnapshot
from pdtui.stimulation.latched_behavior import LatchState

MOST_BEHIND = 2000
"""Control steps by which a ghost may be behind the drive before it is given up."""
_LATCHING = ("behavior", "beside", "release", "default", "unit", "free")
"""Events that begin a ghost where they latch something, or end it where nothing is left."""
_TAKEOVER = ("takeover", "control", "hand back")
_NOTHING_LATCHED = LatchState([], {}, None)


class GhostRunner(Closable):
    """Begins and ends the ghost of a drive: the twin that runs on without the behavior.

    While it is on, a ghost begins whenever a behavior is latched or a unit is held at another output, in the
    state of that step, and follows the drive step by step, with the operator's controls but with no behavior
    and no unit held. It ends when a key or an edit has left nothing latched and nothing held, and where the
    drive jumps: by a reset, a rewind or the end of the episode. A period that runs out does not end it, as
    the aftermath is still to be seen. If a behavior is latched already when the ghost is turned on, or after
    a rewind, it begins there.

    It only reads the drive, and never waits for the ghost.

    Args:
        config: the drive.
        loop: its loop, whose `before_step` is taken.
    """

    def __init__(self, config: DriveConfig, loop: ControlLoop) -> None:
        self._config, self._loop = config, loop
        self._variant = config.ghost
        self._label = "" if config.ghost is None else config.ghost.label
        # A ghost with another policy runs on also while nothing is latched.
        self._runs_alone = config.ghost is not None and config.ghost.has_other_policy
        self._process: GhostProcess | None = None
        self._turned_on = False
        self._first = -1
        self._latest: GhostPose | None = None
        self._unmatched: dict[int, Floats] = {}
        self._ended = self._failure = ""
        self.notice = ""
        """What the user should read now; may be empty."""
        loop.before_step = self._begin_step

    @property
    def pid(self) -> int:
        """Id of the ghost's process; 0 without one."""
        return 0 if self._process is None else self._process.pid

    def toggle(self) -> None:
        """Turn the ghost on, for which a process is started, or off, which ends the process."""
        if self._process is None:
            self._process, self._turned_on, self._failure = GhostProcess(self._config), True, ""
            told = f"it is {self._label}" if self._label else "it runs on without the behavior that you latch"
            self.notice = f"the ghost is on: {told}"
        else:
            self.close()
            self.notice = "the ghost is off"

    def add_step(self, record: StepRecord) -> None:
        """Have the ghost do a control step that the drive has done."""
        if self._process is None or self._first < 0:
            return
        if record.ended:
            self._end()
        elif not self._ended:
            later = record.step > self._first  # earlier events are part of the state
            events = [event for event in record.events if later and event.kind in _TAKEOVER]
            if self._variant is not None:
                events += self._variant.list_events(record, self._loop.map, first=not later)
            self._unmatched[record.step] = record.attributes
            self._process.advance(record.step, events)
            if len(self._unmatched) > MOST_BEHIND:
                self._fail(f"the ghost was given up: it was more than {MOST_BEHIND} steps behind")

    def build_snapshot(self) -> GhostSnapshot | None:
        """Return the ghost's present state, with history and path since the last call; None if it is off."""
        if self._process is not None and self._process.failure:
            self._fail(f"no ghost: {self._process.failure}")
        if self._process is None:
            return GhostSnapshot("failed", self._failure) if self._failure else None
        if not self._process.loaded:
            return GhostSnapshot("loading", first=self._first)
        if self._first < 0:
            return GhostSnapshot("waiting")
        steps = self._process.take_steps()
        for step in steps:
            own = self._unmatched.pop(step.step)
            self._latest = GhostPose(step.step + 1, step.attributes, own, step.poses)
            self._ended = step.ended
        if self._ended:
            self._unmatched.clear()
        return GhostSnapshot(
            "over" if self._ended else "starting" if self._latest is None else "running",
            self._ended,
            self._first,
            self._latest,
            np.array([step.attributes for step in steps]).reshape(-1, len(self._loop.robot.attributes)),
            _path(steps),
            self._label,
        )

    def close(self) -> None:
        """Turn the ghost off."""
        self._end()
        if self._process is not None:
            self._process.close()
        self._process = None

    def _begin_step(self, events: Sequence[DriveEvent]) -> None:
        if self._process is None:
            return
        latched = {behavior.name for behavior in self._loop.latch.active}
        acting = bool(latched or self._loop.latch.held.outputs)
        pressed = [event for event in events if event.kind in _LATCHING]
        jumped = any(event.jumps for event in events)
        goes_on = bool(acting or self._runs_alone)
        if jumped or (pressed and not goes_on):
            self._end()
        begun = any(event.kind in ("unit", "free") or event.name in latched for event in pressed)
        if (acting and begun) or (goes_on and (jumped or self._turned_on)):
            self._begin(self._process)
        self._turned_on = False

    def _begin(self, process: GhostProcess) -> None:
        self._end()
        loop = self._loop
        try:
            state = replace(loop.copy_state(), latch=_NOTHING_LATCHED)
        except PdtuiError as error:  # the drive goes on
            self._fail(f"no ghost: {error}")
        else:
            process.start(GhostStart(loop.step, state, loop.robot.digest(), self._runs_alone))
            self._first = loop.step

    def _end(self) -> None:
        if self._process is not None and self._first >= 0:
            self._process.start(None)
        self._first, self._latest, self._ended = -1, None, ""
        self._unmatched.clear()

    def _fail(self, reason: str) -> None:
        self.close()
        self._failure = self.notice = reason


def _path(steps: Sequence[GhostStepResult]) -> Floats:
    places = [step.poses[0, :2] for step in steps if len(step.poses)]
    return np.array(places).reshape(-1, 2)
