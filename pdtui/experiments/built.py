"""Worker processes for drives, and the loops that they keep: building one takes longer than many episodes."""

from __future__ import annotations

import multiprocessing
from multiprocessing.pool import Pool

from pdtui.dissection.workers import obey_parent
from pdtui.teleop.drive import build_loop
from pdtui.teleop.loop import ControlLoop
from pdtui.teleop.order import DriveOrder

_KEPT: list[tuple[DriveOrder, ControlLoop]] = []


def worker_pool(workers: int) -> Pool:
    """Processes that end with this one and leave Ctrl-C to it; leaving their ``with`` block ends them."""
    return multiprocessing.get_context("spawn").Pool(workers, obey_parent)


def built_once(order: DriveOrder) -> ControlLoop:
    """The loop of an order, built where it is not the one built last; a seed's reset starts it over.

    Raises:
        PdtuiError: robot, policy or map cannot be had.
    """
    if not _KEPT or _KEPT[0][0] != order:
        _KEPT[:] = [(order, build_loop(order))]
    return _KEPT[0][1]
