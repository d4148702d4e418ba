"""Worker processes for drives, and the loops that they keep: building one takes longer than many episodes."""

from __future__ import annotations

import multiprocessing
from multiprocessing.pool import Pool

from pdtui.core.worker_processes import obey_parent
from pdtui.drive.control_loop import ControlLoop
from pdtui.drive.drive_config import DriveConfig
from pdtui.drive.headless import build_loop

_KEPT: list[tuple[DriveConfig, ControlLoop]] = []


def drive_worker_pool(workers: int) -> Pool:
    """Processes that end with this one and leave Ctrl-C to it; leaving their ``with`` block ends them."""
    return multiprocessing.get_context("spawn").Pool(workers, obey_parent)


def cached_loop(config: DriveConfig) -> ControlLoop:
    """The loop of an order, built where it is not the one built last; a seed's reset starts it over.

    Raises:
        PdtuiError: robot, policy or map cannot be had.
    """
    if not _KEPT or _KEPT[0][0] != config:
        _KEPT[:] = [(config, build_loop(config))]
    return _KEPT[0][1]
