"""Whether a drive is certain to start, so that the screen need not wait for the simulation to say so.

Finding out loads neither PyTorch nor a simulator.
"""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from typing import TYPE_CHECKING

from pdtui.core.errors import PdtuiError

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig


def is_certain_to_start(config: DriveConfig) -> bool:
    """Return whether nothing of a drive can be refused any more: robot, policy, map or recording.

    Rare or third-party cases do not count as certain, even if they are valid: environments of other packages,
    policies of other programs, options, starts, and sessions that are watched.
    """
    rare = config.watched is not None or config.start or config.stimulation_map.robot_options
    try:
        return not rare and _has_robot(config) and _has_policy(config) and _can_record(config)
    except PdtuiError:  # the simulation meets it, too, and says it
        return False


def _has_robot(config: DriveConfig) -> bool:
    from pdtui.robots.robot_registry import find_needed_package, find_own_robots

    if config.robot not in find_own_robots():
        return False
    needed = find_needed_package(config.robot)
    return not needed or importlib.util.find_spec(needed) is not None


def _has_policy(config: DriveConfig) -> bool:
    from pdtui.policies.weights.import_options import NO_OPTIONS
    from pdtui.policies.weights.policy_file_lookup import find_weights_file
    from pdtui.policies.weights.weights_header import hash_file, read_weights_header

    own = config.stimulation_map
    if own.import_options != NO_OPTIONS:
        return False
    path = find_weights_file(config.policy or own.policy, (Path(own.source).parent,))
    header = read_weights_header(path)
    if header.get("robot") != config.robot:
        return False
    own.check(config.robot, tuple(header.get("layers", ())), hash_file(path), force=config.force)
    return True


def _can_record(config: DriveConfig) -> bool:
    if not config.recording:
        return True
    path = Path(config.recording)
    if config.existing == "replace" or os.path.lexists(path):
        return False
    folder = next((one for one in path.absolute().parents if os.path.lexists(one)), path.parent)
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)
