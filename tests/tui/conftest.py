"""A recorded drive, and a link that plays it without a process behind it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pdtui.core.errors import PdtuiError
from pdtui.drive.drive_protocol import PaceRequest
from pdtui.drive.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.drive_app import DriveApp
from tests.tui.recorded_snapshots import drive_map, load

DATA = Path(__file__).parent / "data" / "ant.npz"
Message = DriveFacts | DriveSnapshot | PdtuiError


class ScriptedLink:
    """Gives its messages one a poll, then None; remembers what it was asked."""

    def __init__(self, messages: list[Message]) -> None:
        self.messages = list(messages)
        self.pressed: list[str] = []
        self.paced: list[PaceRequest] = []

    def poll(self) -> DriveFacts | DriveSnapshot | None:
        if not self.messages:
            return None
        message = self.messages.pop(0)
        if isinstance(message, PdtuiError):
            raise message
        return message

    def press(self, key: str) -> None:
        self.pressed.append(key)

    def pace(self, request: PaceRequest) -> None:
        self.paced.append(request)

    def close(self) -> str:
        return "stopped: 0 steps"


@pytest.fixture(scope="session")
def drive() -> tuple[DriveFacts, list[DriveSnapshot]]:
    """360 control steps of a half-trained Ant, with stimulations of every kind."""
    return load(DATA)


@pytest.fixture
def a_map() -> StimulationMap:
    return drive_map()


MakeApp = Callable[..., tuple[DriveApp, ScriptedLink]]


@pytest.fixture
def make_app(drive: tuple[DriveFacts, list[DriveSnapshot]], a_map: StimulationMap) -> MakeApp:
    """An application over the first snapshots of the recorded drive, or over other messages."""

    def make(
        messages: list[Message] | int = 3,
        stimulation_map: StimulationMap | None = None,
        watching: bool = False,
    ) -> tuple[DriveApp, ScriptedLink]:
        facts, snapshots = drive
        first = snapshots[:messages] if isinstance(messages, int) else []
        played: list[Message] = [facts, *first] if isinstance(messages, int) else messages
        link = ScriptedLink(played)
        return DriveApp(link, stimulation_map or a_map, fps=200, watching=watching), link

    return make
