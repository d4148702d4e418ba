"""Signals that end a drive between two control steps instead of in the middle of one."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def catch_ending_signals() -> Iterator[Callable[[], str]]:
    """Yield a function that says which signal has come; it returns an empty string while none has.

    By default, SIGTERM and SIGHUP would leave a recording without its end. The handlers are restored at the
    end. Only a program's main thread can do this.
    """
    came: list[str] = []

    def note(number: int, _frame: FrameType | None) -> None:
        came.append(f"ended by {signal.Signals(number).name}")

    before = {number: signal.signal(number, note) for number in ENDING_SIGNALS}
    try:
        yield lambda: came[0] if came else ""
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
