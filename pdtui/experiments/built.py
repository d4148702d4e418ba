"""Loops that worker processes keep: building a robot and loading a policy takes longer than many episodes."""

from __future__ import annotations

from pdtui.teleop.drive import build_loop
from pdtui.teleop.loop import ControlLoop
from pdtui.teleop.order import DriveOrder

_KEPT: list[tuple[DriveOrder, ControlLoop]] = []


def built_once(order: DriveOrder) -> ControlLoop:
    """The loop of an order, built where it is not the one built last; a seed's reset starts it over.

    Raises:
        PdtuiError: robot, policy or map cannot be had.
    """
    if not _KEPT or _KEPT[0][0] != order:
        _KEPT[:] = [(order, build_loop(order))]
    return _KEPT[0][1]
