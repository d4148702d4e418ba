"""What the screen may ask of a running drive, wherever the drive runs."""

from __future__ import annotations

from typing import Literal, Protocol

from pdtui.drive.drive_snapshot import DriveFacts, DriveSnapshot

PaceRequest = Literal["pause", "step", "slower", "faster"]


class DriveConnection(Protocol):
    """The screen's end of the pipe to a drive."""

    def poll(self) -> DriveFacts | DriveSnapshot | None:
        """The newest message that has arrived, or None. A `DriveFacts` comes first, and alone.

        Several waiting snapshots are merged into the newest, histories and paths joined.

        Raises:
            PdtuiError: what ended the simulation's process.
        """

    def press(self, key: str) -> None:
        """Send a key that changes the run; it applies before the next control step."""

    def pace(self, request: PaceRequest) -> None:
        """Change the pacing: no part of the run, so not recorded."""

    def close(self) -> str:
        """End the drive, wait for the recording to be whole, and return one line on how it ended."""
