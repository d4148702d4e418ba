"""The stimulation-evoked map: all behaviors of one policy, as data."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Literal

from pdtui.core.attributes import BehaviorAim
from pdtui.core.errors import MapError, PolicyError
from pdtui.core.units import parse_unit
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.robots.options.robot_option import OptionValue
from pdtui.stimulation.interventions.gait_clock import GaitMark
from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors, Onset

SCHEMA = 1
BehaviorMode = Literal["fixed", "pid"]


@dataclass(frozen=True)
class MeasuredEffect:
    """An effect and its 95 % interval, in the attribute's unit.

    Attributes:
        effect: Mean change of the attribute.
        low, high: Bounds of the interval.
        falls: Roll-outs in which the robot fell; None if the map does not say.
        of: All roll-outs; None if the map does not say.
    """

    effect: float
    low: float
    high: float
    falls: int | None = None
    of: int | None = None


@dataclass(frozen=True)
class MotorPrimitive:
    """The unit that steers one attribute.

    Attributes:
        name: Name by which behaviors of the map refer to it.
        attribute: The attribute that it steers.
        unit: Address of the unit, ``layer:index``.
        rho: Correlation ρ with the attribute; ``v = c ρ`` (section 3.3 of the paper).
        discrepancy: Distance between the spectrograms; None if it was not measured.
        value: Output v at which `measured` was measured.
        measured: Change of the attribute at that output.
    """

    name: str
    attribute: str
    unit: str
    rho: float
    discrepancy: float | None = None
    value: float | None = None
    measured: MeasuredEffect | None = None


@dataclass(frozen=True)
class PidGains:
    """Gains of a behavior that holds an attribute at a target.

    Attributes:
        attribute: The controlled attribute.
        kp, ki, kd: Gains, from the attribute's unit to the magnitude c.
        limit: Bound of c, which stays within ±limit.
        step: Change of the target per press of an arrow key, in the attribute's unit.
    """

    attribute: str
    kp: float
    ki: float
    kd: float
    limit: float
    step: float


@dataclass(frozen=True)
class Behavior:
    """A named stimulation bound to a key.

    Attributes:
        name: Name on the screen.
        key: Key that latches it.
        says: One sentence that says what the robot does.
        magnitudes: Magnitudes c by the names of primitives, and outputs v by ``layer:index``. In mode
            ``pid``, weights that are multiplied by the controller's output.
        base: In mode ``pid``, the outputs v, by ``layer:index``, to which weight × output is added; 0 for a
            unit that is not named.
        interventions: Further changes of hidden units while it is latched, in their order.
        onset: The moment of the gait at which it begins after its key was pressed; None begins at once.
        fade: Time over which its interventions fade when it is let go, s.
        commands: Values of the robot's commands, by name, while it is latched. In mode ``pid``, weights that
            are multiplied by the controller's output.
        period: Activation period T, s; None lasts until another key is pressed.
        together: Names of behaviors that may stay latched with this one.
        mode: ``fixed`` for fixed magnitudes, or ``pid``.
        aim: The change of an attribute that it is meant to cause.
        task: Name of the task that it is meant to perform; empty for none.
        measured: Change of the aim's attribute, compared with the policy alone.
        pid: The controller of mode ``pid``.
    """

    name: str
    key: str
    says: str
    magnitudes: dict[str, float]
    base: dict[str, float] = field(default_factory=dict)
    period: float | None = None
    together: tuple[str, ...] = ()
    mode: BehaviorMode = "fixed"
    aim: BehaviorAim | None = None
    measured: MeasuredEffect | None = None
    pid: PidGains | None = None
    task: str = ""
    commands: dict[str, float] = field(default_factory=dict)
    interventions: tuple[Intervention, ...] = ()
    onset: Onset | None = None
    fade: float = 0.0

    def marks(self) -> tuple[GaitMark, ...]:
        """Return the moments of the gait that must be tracked for it."""
        own = (self.onset.mark,) if self.onset else ()
        return (*own, *(mark for one in self.interventions for mark in one.marks()))


@dataclass(frozen=True)
class StimulationMap:
    """All behaviors of one policy.

    Attributes:
        robot: Name of the robot.
        policy: Weights file, or name of a shipped policy.
        policy_hash: SHA-256 of the weights, or empty.
        default_key: Key that clears every behavior.
        primitives: Motor primitives by name.
        behaviors: Behaviors by name, in the order of the file.
        text: Text of the file.
        source: Name of the map in messages.
        import_options: Answers to what the weights file does not state.
        seeds: Seeds on which anything in the map was searched, tuned or chosen; None if it does not say.
        robot_options: Options with which the robot is built, by name.
        vectors: Vectors that interventions use, by name.
    """

    robot: str
    policy: str
    policy_hash: str
    default_key: str
    primitives: dict[str, MotorPrimitive]
    behaviors: dict[str, Behavior]
    text: str = field(default="", repr=False)
    source: str = "map"
    import_options: ImportOptions = NO_OPTIONS
    seeds: tuple[range, ...] | None = None
    robot_options: dict[str, OptionValue] = field(default_factory=dict)
    vectors: dict[str, LayerVectors] = field(default_factory=dict)

    def units_of(self, behavior: Behavior) -> dict[str, float]:
        """Return a behavior's outputs v by unit address; ``v = c ρ`` for a primitive (section 3.3)."""
        outputs: dict[str, float] = {}
        for name, magnitude in behavior.magnitudes.items():
            primitive = self.primitives.get(name)
            outputs[primitive.unit if primitive else name] = magnitude * (primitive.rho if primitive else 1.0)
        return outputs

    def behavior_of_key(self, key: str) -> Behavior | None:
        """Return the behavior that a key latches, if any."""
        return next((behavior for behavior in self.behaviors.values() if behavior.key == key), None)

    def check_robot(self, robot: str) -> None:
        """Check that the map is for a robot of this name; otherwise raise a `MapError`."""
        if self.robot != robot:
            raise MapError(f"{self.source}: made for robot '{self.robot}', not for '{robot}'")

    def check(self, robot: str, layers: tuple[int, ...], policy_hash: str, *, force: bool = False) -> None:
        """Check that the map fits a policy.

        Raises:
            MapError: The map is for another robot, for another policy and not forced, or names a unit that
                does not exist. A map without behaviors need not name the policy's hash.
        """
        self.check_robot(robot)
        hash_matters = self.policy_hash or self.behaviors
        if hash_matters and self.policy_hash != policy_hash and not force:
            raise MapError(
                f"{self.source}: made for a policy with SHA-256 {self.policy_hash or '(none given)'}, "
                f"the policy here has {policy_hash}"
            )
        for behavior in self.behaviors.values():
            for address in {**self.units_of(behavior), **behavior.base}:
                try:
                    parse_unit(address, layers)
                except PolicyError as error:
                    raise MapError(f"{self.source}: behavior '{behavior.name}': {error}") from error

    def check_commands(self, robot: str, commands: Collection[str]) -> None:
        """Check that a robot of this name has all commands that behaviors give; else raise a `MapError`."""
        for behavior in self.behaviors.values():
            for name in behavior.commands:
                if name not in commands:
                    known = f"available: {', '.join(commands)}" if commands else "it has none"
                    raise MapError(
                        f"{self.source}: behavior '{behavior.name}': {robot} has no command '{name}'; {known}"
                    )
