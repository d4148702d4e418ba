"""Show a drive live in a Rerun viewer; the drive continues whatever happens to the viewer."""

from __future__ import annotations

import atexit
import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import rerun as rr

from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_schema import APP
from pdtui.sessions.viewer.session_blueprint import BEGUN, DriveContent, session_blueprint
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.writer.arrow_columns import ComponentColumn, time_columns
from pdtui.sessions.writer.rerun_recording import send_property

_CLOSE_SECONDS = 2.0
"""How long the end of a drive waits for the viewer, s."""
_WAITING = 2000
"""Number of batches that may wait for the viewer; if there are more, the viewer has stopped."""


class LiveViewer:
    """Sends a drive to a viewer in a separate thread, and gives up on a viewer that ends or stops.

    Args:
        address: address of a viewer that listens.
        info: the drive.
        recording_id: identifier of the session, by which the viewer recognises its file.
    """

    def __init__(self, address: ViewerAddress, info: DriveInfo, recording_id: str) -> None:
        self._info = info
        self._recording = rr.RecordingStream(APP, recording_id=recording_id)
        self._work: queue.Queue[Callable[[], None] | None] = queue.Queue(_WAITING)
        self._lost = False
        self._thread = threading.Thread(target=self._send_all, name="live view", daemon=True)
        url = f"rerun+http://{address}/proxy"
        self._put(lambda: self._recording.set_sinks(rr.GrpcSink(url)))
        # At once, because the viewer may still show the previous drive, laid out for another robot.
        self.lay_out(BEGUN)
        self._thread.start()

    def send(self, entity: str, steps: Sequence[int], columns: list[ComponentColumn]) -> None:
        """Send a batch of rows."""
        times, ready = time_columns(steps, self._info.dt), cast("list[rr.ComponentColumn]", columns)
        self._put(lambda: rr.send_columns(entity, times, ready, recording=self._recording))

    def log_static(self, entity: str, archetype: Any) -> None:
        """Send data that apply at all times."""
        self._put(lambda: rr.log(entity, archetype, static=True, recording=self._recording))

    def send_property(self, name: str, values: Mapping[str, Any]) -> None:
        """Send a group of properties."""
        self._put(lambda: send_property(self._recording, name, values))

    def lay_out(self, content: DriveContent) -> None:
        """Lay the drive out again."""
        self._put(
            lambda: self._recording.send_blueprint(session_blueprint(self._info, content), make_active=True)
        )

    def close(self) -> None:
        """Send what is waiting, if the viewer still accepts it, and disconnect."""
        self._put(None)
        self._thread.join(_CLOSE_SECONDS)
        if self._thread.is_alive():
            # The viewer stopped with its connection open, and the library would wait for it at exit.
            atexit.unregister(rr.rerun_shutdown)

    def _put(self, task: Callable[[], None] | None) -> None:
        if self._lost:
            return
        try:
            self._work.put_nowait(task)
        except queue.Full:
            self._lost = True

    def _send_all(self) -> None:
        try:
            while (task := self._work.get()) is not None:
                task()
            self._recording.disconnect()
        except (OSError, RuntimeError):
            self._lost = True
