"""A pipe that takes what Rerun writes, adds checksums, and hands whole messages to the session's file."""

from __future__ import annotations

import fcntl
import os
import select
import threading
import time
from array import array
from typing import Any

import numpy as np

from pdtui.sessions.rrd import message_framing as framing
from pdtui.sessions.rrd.end_index import encode_end_index
from pdtui.sessions.rrd.footer_positions import shift_footer_positions
from pdtui.sessions.rrd.message_checksum import SEAL_BYTES, compute_start_checksum, seal_message
from pdtui.sessions.writer.session_file import SessionFile

_PIPE_BYTES = 1 << 20
_SYNC_SECONDS = 1.0


class MessagePipe:
    """Passes the messages of a recording on to its file.

    Rerun writes into the pipe from a thread of its own. The messages are taken out by a thread of this
    object, and by `drain`, which returns once everything that Rerun has written was handed to the operating
    system. When the file cannot be written, the rest is thrown away, so that Rerun never waits, and `drain`
    raises the error.

    Args:
        file: the file.

    Attributes:
        file: the file; use it only through this object while the recording is open.
        end_index: what the index at the end of the file shall contain; without it, the file is not whole.
    """

    def __init__(self, file: SessionFile) -> None:
        self.file = file
        self.end_index: dict[str, Any] | None = None
        self._lock = threading.Lock()
        self._received = bytearray()
        self._starts = array("Q")
        self._place = self._checksum = 0
        self._error: OSError | ValueError | None = None
        self._ended = False
        self._reading, self._writing = os.pipe()
        os.set_blocking(self._reading, False)
        if hasattr(fcntl, "F_SETPIPE_SZ"):
            fcntl.fcntl(self._writing, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
        self._thread = threading.Thread(target=self._pass_on, name="pdtui recording", daemon=True)

    @property
    def writing_path(self) -> str:
        """The path that Rerun shall write to."""
        return f"/dev/fd/{self._writing}"

    def start(self) -> None:
        """Start to take messages, once Rerun has opened the pipe; it ends when Rerun closes its end."""
        os.close(self._writing)
        self._thread.start()

    def drain(self) -> None:
        """Hand everything that Rerun has written to the operating system, or raise why it is impossible."""
        with self._lock:
            self._take()
        if self._error is not None:
            raise self._error

    def create_file(self) -> None:
        """Create the file, if that was not done yet."""
        with self._lock:
            if not self.file.on_disk:
                self.file.create()

    def follow_renamed_file(self) -> str:
        """Find out whether the file was deleted or renamed, as `SessionFile.follow_renamed_file` does."""
        with self._lock:
            return self.file.follow_renamed_file()

    def close(self) -> None:
        """Wait until Rerun has closed its end of the pipe, and close the file; raise why it is not whole."""
        self._thread.join()
        os.close(self._reading)
        whole = self._error is None and self.end_index is not None
        self.file.finish(whole=whole)
        if self._error is not None:
            raise self._error

    def _pass_on(self) -> None:
        synchronized = time.monotonic()
        while True:
            select.select([self._reading], [], [])
            with self._lock:
                self._take()
            if self._ended:
                return
            now = time.monotonic()
            if now - synchronized >= _SYNC_SECONDS and self._error is None:
                synchronized = now
                try:
                    self.file.synchronize()
                except OSError as error:
                    self._error = error

    def _take(self) -> None:
        """Take everything that is in the pipe now."""
        while not self._ended:
            try:
                data = os.read(self._reading, _PIPE_BYTES)
            except BlockingIOError:
                break
            self._ended = not data
            self._received += data
            if len(data) < _PIPE_BYTES:
                break
        try:
            if self._error is None:
                self._write_messages()
        except (OSError, ValueError) as error:
            self._error = error
        if self._error is not None:
            self._received.clear()

    def _write_messages(self) -> None:
        received, parts, place = self._received, [], 0
        if not self._place:
            if len(received) < framing.START_BYTES:
                return
            place = framing.START_BYTES
            parts.append(bytes(received[:place]))
            self._checksum = compute_start_checksum(received[:place])
        while len(received) - place >= framing.HEADER_BYTES:
            span = framing.read_span_in_buffer(received, place)
            if span.end > len(received):
                break
            payload = bytes(memoryview(received)[span.start : span.start + span.length])
            if span.kind == framing.LAST:
                written = self._place + place + SEAL_BYTES * len(self._starts)
                parts.append(self._encode_last(payload, written))
            else:
                header, seal, self._checksum = seal_message(span.kind, payload, self._checksum)
                self._starts.append(self._place + span.start)
                parts += header, payload, seal
            place = span.end
        if parts:
            self.file.write(b"".join(parts))
            del received[:place]
            self._place += place

    def _encode_last(self, payload: bytes, place: int) -> bytes:
        starts = np.frombuffer(self._starts, np.uint64) if self._starts else np.empty(0, np.uint64)
        footer = shift_footer_positions(memoryview(payload), starts, SEAL_BYTES)
        if self.end_index is not None:
            index = {**self.end_index, "messages": len(self._starts), "checksum": self._checksum}
            footer += encode_end_index(index)
        return framing.encode_last_message(footer, place)
