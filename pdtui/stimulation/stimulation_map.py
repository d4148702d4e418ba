"""The stimulation-evoked map: all behaviors of one policy, as data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pdtui.core.attributes import BehaviorAim
from pdtui.core.errors import MapError
from pdtui.core.units import parse_unit
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions

SCHEMA = 1
BehaviorMode = Literal["fixed", "pid"]


@dataclass(frozen=True)
class MeasuredEffect:
    """An effect and its 95 % interval, in the attribute's unit.

    Attributes:
        effect: mean change of the attribute.
        low, high: interval of it.
        falls: roll-outs in which the robot fell,
        of: of so many; None where a map does not say.
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
        name: how behaviors of the map refer to it.
        attribute: what it steers.
        unit: its address, ``layer:index``.
        rho: correlation ρ with the attribute; `v = c ρ`.
        discrepancy: distance of the spectrograms, None where matching was not run.
        value: the output v at which `measured` was taken.
        measured: change of the attribute at that v.
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
        attribute: the controlled attribute.
        kp, ki, kd: gains, from the attribute's unit to c.
        limit: c stays within ±limit, which the robot survives.
        step: by how much one press of an arrow key moves the target, in the attribute's unit.
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
        name: what the screen calls it.
        key: the key that latches it.
        says: one sentence on what one sees.
        magnitudes: c for the name of a primitive, v for a ``layer:index``. In mode ``pid`` these are weights
            that the controller's output multiplies.
        base: in mode ``pid``, outputs v at which the controller's output is 0, by ``layer:index``: its
            operating point, to which weight × output is added. A unit that is not named has 0.
        commands: what the policy is asked for meanwhile, by the names of the robot's commands; in mode
            ``pid`` weights that the controller's output multiplies.
        period: activation period T in s; None lasts until another key.
        together: names of behaviors that may stay latched with this one.
        mode: ``fixed`` magnitudes, or ``pid``.
        aim: what it is meant to do to an attribute.
        task: name of what it is meant to accomplish, where that is more than an aim; empty for none.
        measured: change of the aim's attribute, against the default.
        pid: the controller of mode ``pid``.
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


@dataclass(frozen=True)
class StimulationMap:
    """All behaviors of one policy.

    Attributes:
        robot: name of the robot.
        policy: weights file, or name of a shipped policy.
        policy_hash: SHA-256 of the weights.
        default_key: the key that clears everything.
        primitives: by name.
        behaviors: by name, in the order of the file.
        text: the file's text.
        source: where it came from, for messages.
        import_options: what the weights file leaves open.
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

    def units_of(self, behavior: Behavior) -> dict[str, float]:
        """The behavior's outputs v by unit address; ``v = c ρ`` for a primitive (section 3.3)."""
        outputs: dict[str, float] = {}
        for name, magnitude in behavior.magnitudes.items():
            if name in self.primitives:
                primitive = self.primitives[name]
                outputs[primitive.unit] = magnitude * primitive.rho
            else:
                outputs[name] = magnitude
        return outputs

    def behavior_of_key(self, key: str) -> Behavior | None:
        """The behavior that a key latches."""
        return next((behavior for behavior in self.behaviors.values() if behavior.key == key), None)

    def check(self, robot: str, layers: tuple[int, ...], policy_hash: str, *, force: bool = False) -> None:
        """See that the map fits a policy.

        Raises:
            MapError: another robot, another policy (unless forced), or a unit that does not exist. Without
                behaviors, a map need not say which policy it is for.
        """
        from pdtui.core.errors import PolicyError

        if self.robot != robot:
            raise MapError(f"{self.source}: made for robot '{self.robot}', not for '{robot}'")
        said = self.policy_hash or self.behaviors
        if said and self.policy_hash != policy_hash and not force:
            raise MapError(
                f"{self.source}: made for a policy with SHA-256 {self.policy_hash[:12]}…, "
                f"the policy here has {policy_hash[:12]}…; --force drives all the same"
            )
        for behavior in self.behaviors.values():
            for address in {**self.units_of(behavior), **behavior.base}:
                try:
                    parse_unit(address, layers)
                except PolicyError as error:
                    raise MapError(f"{self.source}: behavior '{behavior.name}': {error}") from error
