"""What is known about a drive before its first control step."""

from __future__ import annotations

from dataclasses import dataclass, field

from pdtui.core.attributes import Attribute
from pdtui.core.robot_data import Link
from pdtui.sessions.session_schema import ActivationsKept


@dataclass(frozen=True)
class DriveInfo:
    """What is known about a drive before its first control step; with the events, it determines the run.

    Attributes:
        robot: name of the robot.
        seed: seed of the first reset and of every random number.
        policy: name of the policy.
        policy_hash: SHA-256 of the policy's weights.
        map_text: text of the stimulation-evoked map.
        stochastic: whether actions are sampled from the policy's distribution instead of taking its mean.
        start: state in which episodes start; empty for the robot's default.
        dt: simulated time per control step, s.
        attributes, links: kinematic attributes and links of the robot.
        layers: widths of the policy's hidden layers.
        activations: how activations are recorded, which does not affect the run.
        obstacles: whether there are obstacles where the first episode starts.
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
