"""Show a drive live in a Rerun viewer; the drive continues whatever happens to the viewer."""

from __future__ import annotations

import atexit
import queue
import threading
from collections.abc import Callable

import rerun as rr

from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.viewer.session_blueprint import session_blueprint
from pdtui.sessions.viewer.viewer_address import ViewerAddress

_CLOSE_SECONDS = 2.0
"""How long the end of a drive waits for the viewer, s."""
_WAITING = 2000
"""Number of batches that may wait for the viewer; if there are more, the viewer has stopped."""


class LiveViewer:
    """Sends a drive to a viewer in a separate thread, and gives up on a viewer that ends or stops.

    Args:
        address: address of a viewer that listens.
        info: the drive.
        application, recording_id: identifiers of the session, by which the viewer recognizes its file.
    """

    def __init__(self, address: ViewerAddress, info: DriveInfo, application: str, recording_id: str) -> None:
        self._recording = rr.RecordingStream(application, recording_id=recording_id)
        self._work: queue.Queue[Callable[[rr.RecordingStream], object] | None] = queue.Queue(_WAITING)
        self._lost = False
        self._thread = threading.Thread(target=self._send_all, name="live view", daemon=True)
        url = f"rerun+http://{address}/proxy"
        self.send(lambda recording: recording.set_sinks(rr.GrpcSink(url)))
        # At once, because the viewer may still show the previous drive, laid out for another robot.
        self.send(lambda recording: recording.send_blueprint(session_blueprint(info), make_active=True))
        self._thread.start()

    def send(self, write: Callable[[rr.RecordingStream], object] | None) -> None:
        """Send what a function writes to a recording; None ends the transmission."""
        if self._lost:
            return
        try:
            self._work.put_nowait(write)
        except queue.Full:
            self._lost = True

    def close(self) -> None:
        """Send what is waiting, if the viewer still accepts it, and disconnect."""
        self.send(None)
        self._thread.join(_CLOSE_SECONDS)
        if self._thread.is_alive():
            # The viewer stopped with its connection open, and the library would wait for it at exit.
            atexit.unregister(rr.rerun_shutdown)

    def _send_all(self) -> None:
        try:
            while (write := self._work.get()) is not None:
                write(self._recording)
            self._recording.disconnect()
        except (OSError, RuntimeError):
            self._lost = True
