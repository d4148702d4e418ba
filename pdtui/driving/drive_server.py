"""The drive in the simulation's process, which reads keys from a pipe and sends snapshots through it."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import PdtuiError, format_error_in_one_line
from pdtui.core.outcome import Outcome
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_recording import DriveRecording
from pdtui.driving.ghost.ghost_runner import GhostRunner
from pdtui.driving.keystrokes import interpret_keys, note_press
from pdtui.driving.live_spectra.live_spectra import LiveSpectra
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.pacer import Pacer
from pdtui.driving.pictures.world_pictures import WorldPictures
from pdtui.driving.replays.step_by_step_comparison import StepByStepComparison
from pdtui.driving.snapshot_builder import SnapshotBuilder, describe_loop
from pdtui.driving.timeline.branch_config import BRANCHES_OF_RECORDINGS, configure_branch, find_branch_origin
from pdtui.driving.timeline.past_snapshot import show_past_moment
from pdtui.driving.timeline.run_timeline import RunTimeline
from pdtui.driving.timeline.watched_marks import list_watched_marks
from pdtui.driving.unit_bench.unit_searcher import UnitSearcher
from pdtui.sessions.drive_info import BranchOrigin
from pdtui.sessions.writer.recorder_process import RecorderProcess

_IDLE = 0.05  # longest wait for a request while the drive is paused or over, s


class DriveServer:
    """Runs one drive at its pace, controlled through a pipe.

    A snapshot is built only when the screen has asked for one and the last one has been sent. It is therefore
    the newest, and a screen that has stopped never blocks the drive.

    Args:
        connection: the pipe; requests are read from it.
        send: sends a message through it after those before it, from another thread.
        config: the drive.
    """

    def __init__(
        self, connection: Connection, send: Callable[[object], Future[None]], config: DriveConfig
    ) -> None:
        self._connection, self._send = connection, send
        self._snapshot_requested = False
        self._closing = ""
        self._branches = 0
        length = 0 if config.watched is None else config.watched.steps
        self._recorder = RecorderProcess(soon=bool(config.recording))
        self._begin(config, build_control_loop(config), RunTimeline(length), None)
        dt = self._loop.robot.control_dt
        self._pacer = Pacer(dt, time.monotonic(), keeps_times=bool(config.step_times))

    def _begin(
        self, config: DriveConfig, loop: ControlLoop, timeline: RunTimeline, origin: BranchOrigin | None
    ) -> None:
        self._config, self._loop, self._timeline = config, loop, timeline
        self._ghost = GhostRunner(config, loop)
        self._searcher = UnitSearcher(config, loop)
        self._builder = SnapshotBuilder(loop, self._ghost, self._searcher)
        self._recording = DriveRecording(config, replace(loop.info, branch=origin), self._recorder)
        self._pictures = WorldPictures(loop.robot)
        self._spectra = LiveSpectra(loop.robot.attributes, loop.robot.control_dt)
        self._builder.notice, self._recording.notice = self._recording.notice or self._pictures.notice, ""
        self._pressed_keys: list[str] = []
        self._finished, self.failed = "", False
        self._watched = None if config.watched is None else StepByStepComparison(config.watched, loop.info)

    def send_facts(self) -> None:
        """Send the facts of the drive."""
        keys, ends = list_watched_marks(self._config)
        self._sent = self._send(
            replace(
                describe_loop(self._loop),
                recording=self._recording.path,
                recorded=self._recording.on_disk,
                length=self._timeline.length,
                known_keys=keys,
                known_ends=ends,
                pictured=self._pictures.available,
                branches=self._branches,
            )
        )

    def run(self) -> None:
        """Drive until the screen closes, a signal comes, or the simulation cannot go on."""
        try:
            while not self._closing:
                self._serve()
                if self._snapshot_requested and self._sent.done():
                    self._send_snapshot()
        except Exception as error:
            if not isinstance(error, PdtuiError):
                self._closing = format_error_in_one_line(error)
            raise
        finally:
            self._close_helpers()
            self._pacer.save_times(self._config.step_times)
            self._recording.close(self._finished or self._closing or "an error ended the drive")
            self._recorder.close()

    def stop(self, reason: str) -> None:
        """End the drive after the present step; a signal handler may call this."""
        self._closing = reason

    def outcome(self) -> str:
        """Return one line on how the drive ended."""
        line = f"{self._finished or self._closing}: {self._loop.step} steps"
        place = self._recording.path if self._recording.on_disk else ""
        return f"{line}, recorded in {place}" if place and place not in line else line

    def _seconds_until_due(self) -> float | None:
        """Return the seconds until the next step of the run, or of its past that plays; None for never."""
        if self._timeline.viewed is None and (self._closing or self._finished):
            return None
        return 0.0 if self._timeline.runs_unpaced else self._pacer.seconds_until_due(time.monotonic())

    def _serve(self) -> None:
        """Wait for the next step or a request, whichever comes first."""
        wait = self._seconds_until_due()
        try:
            while self._connection.poll(_IDLE if wait is None else wait):
                self._handle(*self._connection.recv())
                wait = 0.0
        except (EOFError, OSError):
            self._closing = self._closing or "the screen went away"
        due = self._seconds_until_due()
        if self._closing or due is None or due > 0.0:
            return
        if self._timeline.viewed is None:
            self._advance()
        elif self._timeline.play() and self._watched is None:
            self._pacer.paused = True  # the operator takes over from here
        self._pacer.note_step(time.monotonic())

    def _handle(self, kind: str, value: Any) -> None:
        match kind:
            case "press":
                self._press(value)
            case "pace":
                self._pacer.change_pace(value, time.monotonic())
            case "seek":
                self._seek(value)
            case "branch":
                self._branch()
            case "spectra":
                self._spectra.choose(value)
            case "ghost":
                self._ghost.toggle()
            case "search":
                self._builder.notice = self._searcher.begin(value, self._builder.natural.ranges)
            case "frame":
                self._snapshot_requested = True
            case "close":
                self._closing = self._closing or "stopped"

    def _press(self, key: str) -> None:
        """Note a key for the next control step; while the drive is paused, it changes the state at once."""
        if self._watched is not None or self._timeline.viewed is not None or self._timeline.repeats:
            self._builder.notice = "keys change the run at the present only"
            return
        note_press(self._pressed_keys, key)
        if self._pacer.paused and not (self._finished or self._timeline.runs_unpaced):
            events = self._events()
            self._loop.apply_events(events)
            self._builder.show_events(events)

    def _seek(self, moment: int) -> None:
        if not self._timeline.repeats:
            self._pacer.paused = True
            self._builder.notice = self._timeline.seek(moment) or self._builder.notice

    def _branch(self) -> None:
        """Begin a drive that repeats the run up to the moment that is shown, and goes on from there."""
        moment, old = self._timeline.moment, self._recording
        if not moment or self._timeline.repeats:
            self._builder.notice = "there is no step yet from which to branch off"
            return
        origin = find_branch_origin(self._config, old, moment)
        folder = Path(old.path).parent if old.path else BRANCHES_OF_RECORDINGS
        old.close(f"left at step {self._loop.step} for a branch from step {moment}")
        self._close_helpers()
        self._pacer.paused, self._branches = True, self._branches + 1
        config = configure_branch(self._config, origin, folder)
        loop = build_control_loop(config, self._loop.robot, self._loop.policy)
        self._begin(config, loop, self._timeline.branch(), origin)
        self._builder.notice = f"branching off: step {moment} is driven again"
        self.send_facts()

    def _close_helpers(self) -> None:
        for helper in (self._ghost, self._searcher, self._pictures, self._spectra):
            helper.close()

    def _advance(self) -> None:
        record = self._loop.advance(self._events())
        if self._recording.write(record):
            self.send_facts()
        if self._recording.failure:
            self._finished, self.failed = self._recording.failure, True
        self._builder.notice, self._recording.notice = self._recording.notice or self._builder.notice, ""
        self._builder.add_step(record)
        self._timeline.add_step(record)
        if record.outcome is Outcome.DIVERGED:
            self._finished, self.failed = record.ended, True
            self._recording.close(record.ended)
        if self._watched is not None:
            if difference := self._watched.compare(record):
                self._finished, self.failed = difference, True
            elif self._watched.ended:
                self._finished = self._watched.verdict

    def _events(self) -> list[DriveEvent]:
        if self._watched is not None:
            return self._watched.events_before(self._loop.step)
        if self._timeline.repeats:
            return self._timeline.next_events()
        events = []
        for meaning in interpret_keys(self._pressed_keys, self._loop):
            if isinstance(meaning, DriveEvent):
                events.append(meaning)
            else:
                self._builder.notice = meaning
        self._pressed_keys = []
        return events

    def _send_snapshot(self) -> None:
        snapshot = self._builder.build_snapshot(
            paused=self._pacer.paused,
            speed=self._pacer.speed,
            achieved_speed=self._pacer.achieved_speed,
            recorded_bytes=self._recording.bytes,
            finished=self._finished,
        )
        if self._timeline.viewed is not None:
            snapshot = show_past_moment(snapshot, self._timeline)
            self._builder.show_other_scenery()
        picture = self._pictures.draw(self._timeline.moment, past=snapshot.past is not None)
        spectra = self._spectra.update(self._timeline.past, self._timeline.moment)
        self._snapshot_requested = False
        self._sent = self._send(replace(snapshot, picture=picture, spectra=spectra))
