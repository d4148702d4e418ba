"""The drive's side of a search for units: it takes the moment at which the search begins."""

from __future__ import annotations

from pdtui.core.closable import Closable
from pdtui.core.errors import PdtuiError, RobotError
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost.ghost_simulation import GhostStart
from pdtui.driving.unit_bench.natural_ranges import NaturalRanges
from pdtui.driving.unit_bench.unit_search_process import UnitSearchProcess
from pdtui.driving.unit_bench.unit_search_snapshot import UnitSearchRequest, UnitSearchSnapshot


class UnitSearcher(Closable):
    """Searches for units beside a drive, which it only reads.

    Args:
        config: the drive.
        loop: its loop.
    """

    def __init__(self, config: DriveConfig, loop: ControlLoop) -> None:
        self._loop = loop
        self._process = UnitSearchProcess(config)

    @property
    def state(self) -> UnitSearchSnapshot | None:
        """How the present search stands; None before the first."""
        return self._process.state

    def begin(self, request: UnitSearchRequest, ranges: NaturalRanges | None) -> str:
        """Begin a search from the present moment, unless one is under way; return a notice for the user."""
        if self._process.is_searching:
            return "a search is under way; it ends by itself"
        loop, robot = self._loop, self._loop.robot
        try:
            column = robot.attribute_index(request.attribute)
            if robot.repeats_actions:
                raise RobotError(
                    f"{robot.name} returns to a state by repeating the episode, which takes long"
                )
            start = GhostStart(loop.step, loop.copy_state(), robot.digest())
        except PdtuiError as error:
            self._process.fail(request, f"no search: {error}")
            return ""
        self._process.search(request, start, column, ranges)
        return ""

    def close(self) -> None:
        """End the process of the search."""
        self._process.close()
