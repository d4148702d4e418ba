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
        name: Name of the behavior.
        key: Key that latches it.
        says: What one sees, in one sentence.
        aim: The attribute, and where it should go.
        enough: Effect that counts as reached, in the attribute's unit; for a stop, the share of the
            attribute's mean that has to go.
    """

    name: str
    key: str
    says: str
    aim: BehaviorAim
    enough: float


@dataclass(frozen=True)
class HoldBehaviorGoal:
    """A behavior to look for that holds an attribute at a target, which the arrow keys set.

    Attributes:
        name: Name of the behavior.
        key: Key that latches it.
        says: What one sees, in one sentence.
        attribute: The attribute to hold.
        targets: Targets at which controllers are tried: offsets from the attribute's value at the start, in
            its unit, or shares of its mean without stimulation.
        relative_to: Which of the two the targets are.
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
        behaviors: Behaviors, in the order in which they are searched for.
        holds: Behaviors that hold an attribute, in the order in which they are searched for.
        tasks: Names of those of the robot's tasks that a dissection looks for, too: what a robot does by
            pulses rather than by behaviors that last.
        primitives: Names of the motor primitives, by the attribute that each of them steers. A robot with
            none of these attributes gets a primitive for every attribute that can be moved.
    """

    behaviors: tuple[BehaviorGoal, ...] = ()
    holds: tuple[HoldBehaviorGoal, ...] = ()
    tasks: tuple[str, ...] = ()
    primitives: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))


_UP, _DOWN = BehaviorAim("vy", "increase"), BehaviorAim("vy", "decrease")
_LEFT, _RIGHT = BehaviorAim("yaw rate", "increase"), BehaviorAim("yaw rate", "decrease")
_HEADINGS = (-0.8, -0.4, 0.4, 0.8)  # rad from the heading at the start
_PRIMITIVES = {
    "vx": "forward",
    "vy": "sidestep",
    "speed": "pace",
    "yaw": "heading",
    "yaw rate": "turn",
    "height": "height",
}
WALKING_GOALS = RobotGoals(
    behaviors=(
        BehaviorGoal("stop", "x", "stops and stands", BehaviorAim("speed", "stop"), 0.8),
        BehaviorGoal("up", "w", "walks on and drifts to +y", _UP, 0.7),
        BehaviorGoal("down", "s", "walks on and drifts to −y", _DOWN, 0.7),
        BehaviorGoal("spin left", "a", "turns left on the spot, or nearly", _LEFT, 0.5),
        BehaviorGoal("spin right", "d", "turns right on the spot, or nearly", _RIGHT, 0.5),
    ),
    holds=(
        HoldBehaviorGoal(
            "hold heading", "h", "keeps the heading that the arrow keys set", "yaw", _HEADINGS, "start"
        ),
        HoldBehaviorGoal(
            "hold speed", "g", "keeps the speed that the arrow keys set", "speed", (0.4, 0.7), "mean"
        ),
    ),
    primitives=MappingProxyType(_PRIMITIVES),
)
"""For a robot that walks about as fast as the Ant, and the default for every robot."""
