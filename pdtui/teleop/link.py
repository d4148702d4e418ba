"""What the screen may ask of a running drive, wherever the drive runs."""

from __future__ import annotations

from typing import Literal, Protocol

from pdtui.teleop.snapshot import Briefing, Snapshot

Pace = Literal["pause", "step", "slower", "faster"]


class DriveLink(Protocol):
    """The screen's end of the pipe to a drive."""

    def poll(self) -> Briefing | Snapshot | None:
        """The newest message that has arrived, or None. A `Briefing` comes first, and alone.

        Several waiting snapshots are merged into the newest, histories and paths joined.

        Raises:
            PdtuiError: what ended the simulation's process.
        """

    def press(self, key: str) -> None:
        """Send a key that changes the run; it applies before the next control step."""

    def pace(self, request: Pace) -> None:
        """Change the pacing: no part of the run, so not recorded."""

    def close(self) -> str:
        """End the drive, wait for the recording to be whole, and return one line on how it ended."""
