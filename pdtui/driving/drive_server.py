"""The simulation's process, which reads keys from a pipe and sends snapshots through it."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType
from typing import Any

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import PdtuiError, SessionError, format_error_in_one_line
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveFacts
from pdtui.driving.ghost.ghost_runner import GhostRunner
from pdtui.driving.keystrokes import interpret_keys, note_press
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.pacer import Pacer
from pdtui.driving.replays.step_by_step_comparison import StepByStepComparison
from pdtui.driving.snapshot_builder import SnapshotBuilder
from pdtui.driving.unit_bench.unit_searcher import UnitSearcher
from pdtui.sessions.writer.session_recorder import SessionRecorder

_IDLE = 0.05  # longest wait for a request while the drive is paused or over, s
PACED_ROWS_PER_WRITE = 4  # control steps; a drive at its pace is written often, so that a kill loses little


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
        self._connection, self._send, self._config = connection, send, config
        self._loop: ControlLoop = build_control_loop(config)
        self._ghost = GhostRunner(config, self._loop)
        self._searcher = UnitSearcher(config, self._loop)
        self._builder = SnapshotBuilder(self._loop, self._ghost, self._searcher)
        self._recorder: SessionRecorder | None = None
        if config.recording:
            path, viewer = Path(config.recording), config.viewer
            if viewer is not None and not viewer.is_listening:
                self._builder.notice, viewer = viewer.absence_message, None
            info = replace(self._loop.info, activations=config.activations)
            self._recorder = SessionRecorder(
                path,
                info,
                rows_per_write=PACED_ROWS_PER_WRITE,
                viewer=viewer,
                existing=config.existing,
                sync=config.sync,
            )
        self._place, self._snapshot_requested = "", False
        self._pacer = Pacer(self._loop.robot.control_dt, time.monotonic())
        self._pressed_keys: list[str] = []
        self._closing, self._finished, self.failed = "", "", False
        self._watched = (
            None if config.watched is None else StepByStepComparison(config.watched, self._loop.info)
        )

    def send_facts(self) -> None:
        """Send the facts of the drive."""
        loop, recorder = self._loop, self._recorder
        self._sent = self._send(
            DriveFacts(
                title=loop.robot.full_title,
                policy=loop.policy.name,
                seed=loop.seed,
                dt=loop.robot.control_dt,
                attributes=loop.robot.attributes,
                links=loop.robot.links,
                layers=loop.policy.layers,
                recording=str(recorder.path) if recorder is not None else "",
                recorded=recorder is not None and recorder.created,
                manual_controls=tuple(control.name for control in loop.robot.manual_controls),
                policy_hash=loop.policy.sha256,
                output_bounds=loop.policy.output_bounds,
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
            self._ghost.close()
            self._searcher.close()
            self._close_recording()

    def stop(self, reason: str) -> None:
        """End the drive after the present step; a signal handler may call this."""
        self._closing = reason

    def outcome(self) -> str:
        """Return one line on how the drive ended."""
        line = f"{self._finished or self._closing}: {self._loop.step} steps"
        recorder = self._recorder
        place = str(recorder.path) if recorder is not None and recorder.created else ""
        return f"{line}, recorded in {place}" if place and place not in line else line

    def _serve(self) -> None:
        """Wait for the next step or a request, whichever comes first."""
        wait = None if self._finished else self._pacer.seconds_until_due(time.monotonic())
        try:
            while self._connection.poll(_IDLE if wait is None else wait):
                self._handle(*self._connection.recv())
                wait = 0.0
        except (EOFError, OSError):
            self._closing = self._closing or "the screen went away"
        if self._closing or self._finished:
            return
        due = self._pacer.seconds_until_due(time.monotonic())
        if due is not None and due <= 0.0:
            self._advance()

    def _handle(self, kind: str, value: Any) -> None:
        match kind:
            case "press":
                note_press(self._pressed_keys, value)
            case "pace":
                self._pacer.change_pace(value, time.monotonic())
            case "ghost":
                self._ghost.toggle()
            case "search":
                self._builder.notice = self._searcher.begin(value, self._builder.natural.ranges)
            case "frame":
                self._snapshot_requested = True
            case "close":
                self._closing = self._closing or "stopped"

    def _advance(self) -> None:
        record = self._loop.advance(self._events())
        if self._recorder is not None:
            self._record(self._recorder, record)
        self._builder.add_step(record)
        self._pacer.note_step(time.monotonic())
        if record.outcome is Outcome.DIVERGED:
            self._finished, self.failed = record.ended, True
            self._close_recording()
        if self._watched is not None:
            self._compare(self._watched, record)

    def _record(self, recorder: SessionRecorder, record: StepRecord) -> None:
        try:
            recorder.write(record)
        except SessionError as error:
            # A step that is not recorded cannot be repeated, so the drive ends here and the screen says why.
            self._finished, self.failed = str(error), True
            with suppress(SessionError):
                recorder.close(str(error))
        if recorder.notice:
            self._builder.notice, recorder.notice = recorder.notice, ""
        if recorder.created and str(recorder.path) != self._place:
            self._place = str(recorder.path)
            self.send_facts()

    def _events(self) -> list[DriveEvent]:
        if self._watched is not None:
            return self._watched.events_before(self._loop.step)
        events = []
        for meaning in interpret_keys(self._pressed_keys, self._loop):
            if isinstance(meaning, DriveEvent):
                events.append(meaning)
            else:
                self._builder.notice = meaning
        self._pressed_keys = []
        return events

    def _compare(self, watched: StepByStepComparison, record: StepRecord) -> None:
        if difference := watched.compare(record):
            self._finished, self.failed = difference, True
        elif watched.ended:
            self._finished = f"identical, {watched.steps} steps"

    def _send_snapshot(self) -> None:
        snapshot = self._builder.build_snapshot(
            paused=self._pacer.paused,
            speed=self._pacer.speed,
            achieved_speed=self._pacer.achieved_speed,
            recorded_bytes=0 if self._recorder is None else self._recorder.bytes,
            finished=self._finished,
        )
        self._snapshot_requested = False
        self._sent = self._send(snapshot)

    def _close_recording(self) -> None:
        if self._recorder is not None:
            self._recorder.close(self._finished or self._closing or "an error ended the drive")


def serve_drive(connection: Connection, config: DriveConfig) -> None:
    """Run the process of a drive; what ends it is sent as a line of text or an exception."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the screen handles ctrl+c
    # Sending a message that is larger than the pipe's buffer takes until the screen has taken the rest, and a
    # stopped screen never does. Messages to a screen that has gone away are dropped.
    sender = ThreadPoolExecutor(max_workers=1)

    def send(message: object) -> Future[None]:
        return sender.submit(connection.send, message)

    server: DriveServer | None = None
    early: list[str] = []

    def stop(number: int, _frame: FrameType | None) -> None:
        reason = f"ended by {signal.Signals(number).name}"
        early.append(reason)
        if server is not None:
            server.stop(reason)

    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    try:
        server = DriveServer(connection, send, config)
        for reason in early:
            server.stop(reason)
        server.send_facts()
        server.run()
        outcome = server.outcome()
        send(PdtuiError(outcome) if server.failed else outcome)
    except PdtuiError as error:
        send(error)
    except Exception as error:
        # The screen would hide a traceback.
        said = format_error_in_one_line(error) if server is None else server.outcome()
        send(PdtuiError(f"the simulation failed: {said}"))
    sender.shutdown()
