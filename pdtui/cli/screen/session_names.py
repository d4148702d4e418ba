"""Names of sessions that were not given one."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING

from pdtui.core.settings.settings_file import own_folder

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig


def record_into_new_session(config: DriveConfig) -> DriveConfig:
    """Return the drive with a name for its session, to which a number is appended if it is taken."""
    from pdtui.robots import robot_file_stem

    name = f"{robot_file_stem(config.robot)}-{datetime.now():%Y%m%d-%H%M%S}-seed{config.seed}.rrd"
    return replace(config, recording=str(own_folder("sessions") / name), existing="number")
