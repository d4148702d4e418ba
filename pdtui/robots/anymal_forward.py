"""ANYmal-C whose policy follows one command."""

from __future__ import annotations

from types import MappingProxyType

from pdtui.robots.anymal import Anymal


class AnymalForward(Anymal):
    """ANYmal-C whose policy sees the forward command alone: it was never asked to turn."""

    name = "anymal-forward"
    title = "ANYmal-C, forward only (MuJoCo)"
    commands = MappingProxyType({"forward": 1.0})
