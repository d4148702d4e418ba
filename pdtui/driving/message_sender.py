"""Sending messages through a pipe without waiting for the process that reads it."""

from __future__ import annotations

from contextlib import suppress
from multiprocessing.connection import Connection
from queue import Queue
from threading import Thread
from typing import Any


class MessageSender:
    """Sends messages from a thread of its own, in their order.

    Sending a message that is larger than the pipe's buffer takes until the reader has taken the rest, and a
    stopped reader never does. Messages to a reader that has gone away are dropped.

    Args:
        connection: the pipe; nothing else may send through it.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._messages: Queue[Any] = Queue()
        Thread(target=self._send_messages, daemon=True).start()

    @property
    def idle(self) -> bool:
        """Whether nothing waits to be sent."""
        return self._messages.unfinished_tasks == 0

    def send(self, message: object) -> None:
        """Send a message, which must not change any more, after those before it."""
        self._messages.put(message)

    def flush(self) -> None:
        """Wait until every message has been sent or dropped."""
        self._messages.join()

    def _send_messages(self) -> None:
        while True:
            message = self._messages.get()
            with suppress(OSError):
                self._connection.send(message)
            self._messages.task_done()
