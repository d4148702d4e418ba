"""The process of a drive: its signals, its messages, and how it ends."""

from __future__ import annotations

import signal
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing.connection import Connection
from types import FrameType

from pdtui.core.errors import PdtuiError, format_error_in_one_line
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_server import DriveServer


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
