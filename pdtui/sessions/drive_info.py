"""What one control step leaves behind, and what is known before the first."""

from __future__ import annotations

from dataclasses import dataclass, field

from pdtui.core.attributes import Attribute
from pdtui.core.robot_data import Link
from pdtui.sessions.session_schema import ActivationsKept


@dataclass(frozen=True)
class DriveInfo:
    """What is known before the first control step: with the events, it determines the run.

    Attributes:
        robot: name of the robot.
        seed: of the first reset and of every random number.
        policy: name of the policy.
        policy_hash: SHA-256 of its weights.
        map_text: the map, whole.
        stochastic: whether actions are drawn from the policy's distribution instead of its mean.
        start: state in which episodes start, empty for the robot's usual one.
        dt: simulated time of a control step, s.
        attributes, links, layers: of robot and policy.
        activations: how they are recorded; no part of the run.
        obstacles: whether there are any where the first episode starts.
    """

    robot: str
    seed: int
    policy: str
    policy_hash: str
    map_text: str = field(repr=False)
    stochastic: bool
    dt: float
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]
    layers: tuple[int, ...]
    activations: ActivationsKept = "all"
    start: str = ""
    obstacles: bool = False
