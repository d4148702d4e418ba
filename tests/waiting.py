"""Waits for work that goes on in another process."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

from pdtui.sessions.session_integrity import examine_session

PATIENCE = 240.0
"""Longest wait, s."""


class Progress(Protocol):
    """What is known of a piece of work."""

    @property
    def condition(self) -> str: ...


Known = TypeVar("Known", bound=Progress)


def wait_until_over(read_state: Callable[[], Known | None]) -> Known:
    """Return the state of a piece of work once it is done or has failed."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        state = read_state()
        if state is not None and state.condition in ("done", "failed"):
            return state
        time.sleep(0.02)
    raise AssertionError(f"the work was not over in {PATIENCE:g} s: {read_state()}")


def wait_until_whole(path: Path) -> None:
    """Wait until the recorder of a drive that was killed has completed the session."""
    deadline = time.monotonic() + PATIENCE
    while not (path.exists() and examine_session(path).whole):
        assert time.monotonic() < deadline, f"{path} was not whole in {PATIENCE:g} s"
        time.sleep(0.05)
