"""What a branch of a drive is recorded into, and what its recording says of where it branched off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_recording import DriveRecording
from pdtui.sessions.drive_info import BranchOrigin

BRANCHES_OF_RECORDINGS = Path("sessions")
"""Folder of branches off a recording that is watched, which may lie anywhere."""


def find_branch_origin(config: DriveConfig, recording: DriveRecording, step: int) -> BranchOrigin | None:
    """Return where a branch at a control step branches off; None if the drive is not recorded."""
    if config.watched is not None:
        return BranchOrigin(config.watched.path.name, config.watched.created, step)
    return BranchOrigin(Path(recording.path).name, recording.created, step) if recording.path else None


def configure_branch(config: DriveConfig, origin: BranchOrigin | None, folder: Path | None) -> DriveConfig:
    """Return the configuration of a branch, which is recorded into a new file if there is a folder."""
    branch = replace(config, watched=None, recording="", existing="number")
    if origin is None or folder is None:
        return branch
    name = f"{Path(origin.session).stem}-from-step-{origin.step}.rrd"
    return replace(branch, recording=str(folder / name))
