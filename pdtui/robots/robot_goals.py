"""What a dissection looks for on a robot: behaviors, attributes to hold, and names of motor primitives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from pdtui.core.attributes import BehaviorAim


@dataclass(frozen=True)
class BehaviorGoal:
    """A behavior to look for.

    Attributes:
        name: name of the behavior.
        key: key that latches it.
        says: one sentence on what one sees.
        aim: the attribute and where it is to go.
        enough: effect that counts as reached, in the attribute's unit; for a stop, the share of the
            attribute's mean that has to go.
    """

    name: str
    key: str
    says: str
    aim: BehaviorAim
    enough: float


@dataclass(frozen=True)
class HoldGoal:
    """A behavior to look for that holds an attribute at a target, which the arrow keys set.

    Attributes:
        name: name of the behavior.
        key: key that latches it.
        says: one sentence on what one sees.
        attribute: the attribute to hold.
        targets: where controllers are tried: offsets from the attribute's value at the start, in its unit, or
            shares of its mean without stimulation.
        relative_to: which of the two.
    """

    name: str
    key: str
    says: str
    attribute: str
    targets: tuple[float, ...]
    relative_to: Literal["start", "mean"]


@dataclass(frozen=True)
class RobotGoals:
    """Everything that a dissection looks for on a robot. Goals for attributes that it lacks are skipped.

    Attributes:
        behaviors: behaviors, in the order in which they are searched for.
        holds: behaviors that hold an attribute, in the order in which they are searched for.
        primitives: names of the motor primitives, by the attribute that each of them steers; a robot with
            none of these attributes gets a primitive for every attribute that can be moved.
    """

    behaviors: tuple[BehaviorGoal, ...] = ()
    holds: tuple[HoldGoal, ...] = ()
    primitives: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))


WALKING_GOALS = RobotGoals(
    behaviors=(
        BehaviorGoal("stop", "x", "stops and stands", BehaviorAim("speed", "stop"), 0.8),
        BehaviorGoal("up", "w", "walks on and drifts to +y", BehaviorAim("vy", "increase"), 0.7),
        BehaviorGoal("down", "s", "walks on and drifts to −y", BehaviorAim("vy", "decrease"), 0.7),
        BehaviorGoal(
            "spin left", "a", "turns left on the spot, or nearly", BehaviorAim("yaw rate", "increase"), 0.5
        ),
        BehaviorGoal(
            "spin right", "d", "turns right on the spot, or nearly", BehaviorAim("yaw rate", "decrease"), 0.5
        ),
    ),
    holds=(
        HoldGoal(
            "hold heading",
            "h",
            "keeps the heading that the arrow keys set",
            "yaw",
            (-0.8, -0.4, 0.4, 0.8),
            "start",
        ),
        HoldGoal("hold speed", "g", "keeps the speed that the arrow keys set", "speed", (0.4, 0.7), "mean"),
    ),
    primitives=MappingProxyType(
        {
            "vx": "forward",
            "vy": "sidestep",
            "speed": "pace",
            "yaw": "heading",
            "yaw rate": "turn",
            "height": "height",
        }
    ),
)
"""For a robot that walks about as fast as the Ant, and for one whose class declares nothing else."""
