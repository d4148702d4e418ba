"""Drives of the simulation's own process, watched as the screen would, to which something happens."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from pdtui.core.errors import PdtuiError
from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.stimulation.map_reader import load_map
from tests.faults.fault_bench import FaultBench

PATIENCE = 120.0
_AT_ONCE = 3
_KEYS = ("w", "t", "h", "space", "r", "backspace")


class WatchedDrive:
    """One paced drive with random keys.

    Args:
        bench: the bench.
        path: the recording.
        happens: called once, with the drive, at a random moment of it.
        after: seconds to go on after it before the drive is closed; None for one that ends by itself.

    Attributes:
        path: the recording.
        driven: control steps that were certainly done.
        notices: what the screen said besides.
        last_words: the line that the drive ends with.
    """

    def __init__(
        self,
        bench: FaultBench,
        path: Path,
        happens: Callable[[WatchedDrive], None],
        *,
        after: float | None = None,
    ) -> None:
        self.path, self._happens, self._after, self._drawn = path, happens, after, bench.drawn
        config = DriveConfig(
            "ant", load_map(bench.map_path), bench.drawn.randrange(1000), recording=str(path)
        )
        self.client = DriveClient(config)
        self._moment: float | None = None
        self._lasts = bench.drawn.uniform(0.0, 2.0)
        self._happened = False
        self.driven, self.over = 0, False
        self.notices: list[str] = []
        self.last_words = ""

    def serve(self) -> None:
        """Take one message; press a key now and then."""
        try:
            message = self.client.poll_message()
        except PdtuiError:
            self._close()
            return
        now = time.monotonic()
        if self._happened:
            if self._after is not None and self._moment is not None and now >= self._moment + self._after:
                self._close()
                return
            if self._after is None:
                return
        if not isinstance(message, DriveSnapshot):
            return
        self.driven = message.step
        if message.notice and message.notice not in self.notices:
            self.notices.append(message.notice)
        if self._moment is None and self.driven and self.path.exists():
            self._moment = now + self._lasts
            for _ in range(self._drawn.randrange(3)):
                self.client.change_pace("faster")
        elif self._drawn.random() < 0.1:
            self.client.press_key(self._drawn.choice(_KEYS))
        if self._moment is not None and now >= self._moment and not self._happened:
            self._happens(self)
            self._happened = True

    def _close(self) -> None:
        self.over = True
        self.last_words = self.client.close()


def run_watched_drives(
    number: int, begin: Callable[[int], WatchedDrive], judge: Callable[[WatchedDrive], None]
) -> None:
    """Run drives, a few at once, and judge each when it is over."""
    for first in range(0, number, _AT_ONCE):
        drives = [begin(one) for one in range(first, min(number, first + _AT_ONCE))]
        _serve(drives)
        for drive in drives:
            judge(drive)
            for file in drive.path.parent.glob(f"{drive.path.stem}*.rrd"):
                file.unlink()


def _serve(drives: Sequence[WatchedDrive]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not all(drive.over for drive in drives):
        if time.monotonic() > deadline:
            raise AssertionError(f"a drive did not end in {PATIENCE:g} s")
        for drive in drives:
            if not drive.over:
                drive.serve()
        time.sleep(0.002)
