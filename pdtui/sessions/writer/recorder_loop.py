"""The process that records drives: it takes control steps out of a ring and writes them."""

from __future__ import annotations

import signal
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from pdtui.core.errors import PdtuiError, SessionError, format_error_in_one_line
from pdtui.core.processes.shared_ring import SharedRing
from pdtui.sessions.writer.step_record_codec import StepRecordDecoder

if TYPE_CHECKING:
    from pdtui.sessions.writer.session_recorder import SessionRecorder

KILLED = "the drive's process ended before its recording"
"""How a drive ended that did not close its recording."""
_SHORTEST_WAIT, _LONGEST_WAIT = 0.001, 0.02
"""Times between looks into an empty ring, s: the longer it has been empty, the longer."""


@dataclass(frozen=True)
class RecordingState:
    """What the drive is told of its recording.

    Attributes:
        path, on_disk, created: as in `SessionRecorder`.
        notice: one line on what happened to the file; empty if nothing did.
        failure: why the recording had to end; None while it goes on.
        closed: whether it is complete.
    """

    path: Path
    on_disk: bool
    created: str
    notice: str = ""
    failure: SessionError | None = None
    closed: bool = False


def serve_recordings(connection: Connection) -> None:
    """Record one drive after the other, until the drive's process closes the pipe or ends."""
    # Signals to the whole group end the drive, which then completes its recording.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    # Loaded at once, while the drive loads its world.
    from pdtui.sessions.writer.session_recorder import SessionRecorder

    with suppress(EOFError, OSError):
        while True:
            ring_path, options = connection.recv()
            with SharedRing(ring_path) as ring:
                ring.unlink()  # nothing is left of it when both processes have ended
                try:
                    recorder = SessionRecorder(**options)
                except Exception as error:
                    connection.send(as_session_error(error))
                    continue
                _Recording(connection, ring, recorder).run()


class _Recording:
    """One recording: what the drive writes into the ring, until it says that it is over or ends.

    Args:
        connection: the pipe; only how the drive ended comes through it, and states go.
        ring: the ring with the control steps.
        recorder: writes them.
    """

    def __init__(self, connection: Connection, ring: SharedRing, recorder: SessionRecorder) -> None:
        self._connection, self._ring, self._recorder = connection, ring, recorder
        self._decoder = StepRecordDecoder()
        self._failure: SessionError | None = None
        self._sent: RecordingState | None = None

    def run(self) -> None:
        """Record until the drive is over."""
        self._send_state()
        wait = _SHORTEST_WAIT
        while True:
            if self._write_all():
                wait = _SHORTEST_WAIT
            try:
                if self._connection.poll(wait):
                    outcome = self._connection.recv()
                    break
            except (EOFError, OSError):
                outcome = KILLED
                break
            wait = min(_LONGEST_WAIT, 2 * wait)
        self._write_all()
        try:
            self._recorder.close(outcome)
        except Exception as error:
            self._failure = self._failure or as_session_error(error)
        self._send_state(closed=True)

    def _write_all(self) -> bool:
        """Write what is in the ring, and return whether anything was."""
        found = False
        while (message := self._ring.read()) is not None:
            found = True
            if self._failure is None:
                self._write(message)
        return found

    def _write(self, message: bytes) -> None:
        try:
            self._recorder.write(self._decoder.decode(message))
        except Exception as error:
            self._failure = as_session_error(error)
            with suppress(Exception):
                self._recorder.close(str(self._failure))
        self._send_state()

    def _send_state(self, *, closed: bool = False) -> None:
        recorder = self._recorder
        self._ring.reader_value = recorder.bytes
        notice, recorder.notice = recorder.notice, ""
        state = RecordingState(
            recorder.path, recorder.on_disk, recorder.created, notice, self._failure, closed
        )
        if state != self._sent:
            self._sent = state
            with suppress(OSError):  # the drive has ended
                self._connection.send(state)
            self._ring.increment_notice_count()


def as_session_error(error: Exception) -> SessionError:
    """Return an error as one that the drive's process can be sent."""
    if isinstance(error, SessionError):
        return error
    return SessionError(str(error) if isinstance(error, PdtuiError) else format_error_in_one_line(error))
