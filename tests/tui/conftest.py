"""A recorded drive, and a connection that plays it without a process behind it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pdtui.core.errors import PdtuiError
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.live_spectra.spectra_snapshot import SpectraChoice
from pdtui.driving.pacer import PaceRequest
from pdtui.driving.unit_bench.unit_search_snapshot import UnitSearchRequest
from pdtui.stimulation.stimulation_map import StimulationMap
from pdtui.tui.drive_app import DriveApp
from tests.tui.recorded_snapshots import drive_map, load

DATA = Path(__file__).parent / "data" / "ant.npz"
Message = DriveFacts | DriveSnapshot | PdtuiError


class ScriptedConnection:
    """Gives its messages one a poll, then None; remembers what it was asked."""

    def __init__(self, messages: list[Message]) -> None:
        self.messages = list(messages)
        self.pressed: list[str] = []
        self.paced: list[PaceRequest] = []
        self.toggled = 0
        self.sought: list[int] = []
        self.branched = 0
        self.spectra: list[SpectraChoice | None] = []
        self.searched: list[UnitSearchRequest] = []

    def poll_message(self) -> DriveFacts | DriveSnapshot | None:
        if not self.messages:
            return None
        message = self.messages.pop(0)
        if isinstance(message, PdtuiError):
            raise message
        return message

    def press_key(self, key: str) -> None:
        self.pressed.append(key)

    def change_pace(self, request: PaceRequest) -> None:
        self.paced.append(request)

    def toggle_ghost(self) -> None:
        self.toggled += 1

    def seek(self, moment: int) -> None:
        self.sought.append(moment)

    def choose_spectra(self, choice: SpectraChoice | None) -> None:
        self.spectra.append(choice)

    def branch(self) -> None:
        self.branched += 1

    def search_units(self, request: UnitSearchRequest) -> None:
        self.searched.append(request)

    def close(self) -> str:
        return "stopped: 0 steps"


@pytest.fixture(scope="session")
def drive() -> tuple[DriveFacts, list[DriveSnapshot]]:
    """360 control steps of a half-trained Ant, with stimulations of every kind."""
    return load(DATA)


@pytest.fixture
def a_map() -> StimulationMap:
    return drive_map()


MakeApp = Callable[..., tuple[DriveApp, ScriptedConnection]]


@pytest.fixture
def make_app(drive: tuple[DriveFacts, list[DriveSnapshot]], a_map: StimulationMap) -> MakeApp:
    """An application over the first snapshots of the recorded drive, or over other messages."""

    def make(
        messages: list[Message] | int = 3,
        stimulation_map: StimulationMap | None = None,
        watching: bool = False,
    ) -> tuple[DriveApp, ScriptedConnection]:
        facts, snapshots = drive
        first = snapshots[:messages] if isinstance(messages, int) else []
        played: list[Message] = [facts, *first] if isinstance(messages, int) else messages
        connection = ScriptedConnection(played)
        return DriveApp(connection, stimulation_map or a_map, fps=200, watching=watching), connection

    return make
