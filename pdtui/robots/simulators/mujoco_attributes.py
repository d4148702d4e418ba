"""Kinematic attributes that a MuJoCo model has by itself: of its root body, its joints and its motors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import mujoco
import numpy as np

from pdtui.core.attributes import Attribute, wrap_angle
from pdtui.robots.geometry import roll_pitch_yaw, rotate

_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_STRAIGHT = 0.999
_VELOCITIES = ("vx", "vy", "vz")
_ANGLES = ("roll", "pitch", "yaw")
_AXES = "xyz"

Read = Callable[[mujoco.MjData], float]


@dataclass(frozen=True)
class MeasuredAttribute:
    """An attribute and how it is read from the simulator's data."""

    attribute: Attribute
    read: Read


def model_attributes(model: mujoco.MjModel) -> tuple[MeasuredAttribute, ...]:
    """Everything of a model that is worth measuring.

    The root is the heaviest tree of bodies that moves. A free joint gives it ``vx``, ``vy``, ``vz``,
    ``speed`` (horizontal), ``height``, ``roll``, ``pitch``, ``yaw`` and their rates: yaw's about the
    vertical, the other two about the body's own axes. A root on slides along the axes and at most one hinge
    about one, as planar walkers have it, gives those of these that it moves; a horizontal slide with limits
    also its position. Every other joint gives its angle (or position) and velocity, every motor its torque
    (or force) as MuJoCo last applied it.

    Angles without limits wrap at ±π. Scales are 1, because environments observe positions and velocities as
    they are; a motor's brings its torque to that of its control signal.
    """
    root = _root_of(model)
    own = [joint for joint in range(model.njnt) if model.jnt_bodyid[joint] == root]
    found = _free_root(model, own) or _planar_root(model, root, own)
    for joint in range(model.njnt):
        if not found or joint not in own:
            found += _joint(model, joint)
    return _unique(found + [_motor(model, index) for index in range(model.nu)])


def _root_of(model: mujoco.MjModel) -> int:
    moving = [
        body for body in range(1, model.nbody) if model.body_parentid[body] == 0 and model.body_jntnum[body]
    ]
    return max(moving, key=lambda body: float(model.body_subtreemass[body]), default=0)


def _free_root(model: mujoco.MjModel, own: list[int]) -> list[MeasuredAttribute]:
    if not own or model.jnt_type[own[0]] != _FREE:
        return []
    q, v = int(model.jnt_qposadr[own[0]]), int(model.jnt_dofadr[own[0]])

    def angle(axis: int, data: mujoco.MjData) -> float:
        return roll_pitch_yaw(*data.qpos[q + 3 : q + 7].tolist())[axis]

    def yaw_rate(data: mujoco.MjData) -> float:
        # MuJoCo's angular velocity of a free joint is in the body's frame.
        return float(rotate(data.qpos[q + 3 : q + 7], data.qvel[v + 3 : v + 6])[2])

    linear = [
        MeasuredAttribute(Attribute(name, "m/s"), _velocity(v + axis))
        for axis, name in enumerate(_VELOCITIES)
    ]
    angles = [
        MeasuredAttribute(Attribute(name, "rad", wraps=name != "pitch"), partial(angle, axis))
        for axis, name in enumerate(_ANGLES)
    ]
    return [
        *linear,
        _speed([linear[0].read, linear[1].read]),
        MeasuredAttribute(Attribute("height", "m"), _position(q + 2)),
        *angles,
        MeasuredAttribute(Attribute("roll rate", "rad/s"), _velocity(v + 3)),
        MeasuredAttribute(Attribute("pitch rate", "rad/s"), _velocity(v + 4)),
        MeasuredAttribute(Attribute("yaw rate", "rad/s"), yaw_rate),
    ]


def _planar_root(model: mujoco.MjModel, root: int, own: list[int]) -> list[MeasuredAttribute]:
    kinds = [int(model.jnt_type[joint]) for joint in own]
    # A slide after a hinge turns with it, and of two hinges neither is an angle against the world.
    if (
        _SLIDE not in kinds
        or kinds != sorted(kinds)
        or kinds.count(_HINGE) > 1
        or set(kinds) - {_SLIDE, _HINGE}
    ):
        return []
    found: list[MeasuredAttribute] = []
    horizontal: list[Read] = []
    for joint, kind in zip(own, kinds, strict=True):
        direction = rotate(model.body_quat[root], model.jnt_axis[joint])
        axis = int(np.argmax(np.abs(direction)))
        if abs(direction[axis]) < _STRAIGHT:
            return []
        sign = math.copysign(1.0, float(direction[axis]))
        q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        start = -sign * float(model.qpos0[q])
        limited = bool(model.jnt_limited[joint])
        if kind == _HINGE:
            found.append(_angle(_ANGLES[axis], q, sign, start, limited))
            found.append(MeasuredAttribute(Attribute(f"{_ANGLES[axis]} rate", "rad/s"), _velocity(v, sign)))
            continue
        found.append(MeasuredAttribute(Attribute(_VELOCITIES[axis], "m/s"), _velocity(v, sign)))
        start += float(model.body_pos[root][axis])
        if axis == 2:
            found.append(MeasuredAttribute(Attribute("height", "m"), _position(q, sign, start)))
            continue
        horizontal.append(found[-1].read)
        if limited:
            found.append(MeasuredAttribute(Attribute(_AXES[axis], "m"), _position(q, sign, start)))
    return [*found, _speed(horizontal)] if horizontal else found


def _joint(model: mujoco.MjModel, joint: int) -> list[MeasuredAttribute]:
    label, kind = _label(model, joint), int(model.jnt_type[joint])
    q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    if kind == _HINGE:
        limited = bool(model.jnt_limited[joint])
        rate = MeasuredAttribute(Attribute(f"{label} velocity", "rad/s"), _velocity(v))
        return [_angle(f"{label} angle", q, 1.0, 0.0, limited), rate]
    if kind == _SLIDE:
        return [
            MeasuredAttribute(Attribute(f"{label} position", "m"), _position(q)),
            MeasuredAttribute(Attribute(f"{label} velocity", "m/s"), _velocity(v)),
        ]
    if kind == _BALL:
        return [
            MeasuredAttribute(Attribute(f"{label} velocity {name}", "rad/s"), _velocity(v + axis))
            for axis, name in enumerate(_AXES)
        ]
    return [
        MeasuredAttribute(Attribute(f"{label} {name}", "m"), _position(q + axis))
        for axis, name in enumerate(_AXES)
    ]


def _motor(model: mujoco.MjModel, index: int) -> MeasuredAttribute:
    motor = model.actuator(index)
    turns, gear, label = False, 1.0, motor.name or f"motor {index}"
    if int(model.actuator_trntype[index]) in (
        int(mujoco.mjtTrn.mjTRN_JOINT),
        int(mujoco.mjtTrn.mjTRN_JOINTINPARENT),
    ):
        joint = int(model.actuator_trnid[index, 0])
        turns, gear = int(model.jnt_type[joint]) == _HINGE, float(model.actuator_gear[index, 0])
        label = motor.name or _label(model, joint)

    def read(data: mujoco.MjData) -> float:
        return gear * float(data.actuator_force[index])

    name, unit = (f"{label} torque", "N m") if turns else (f"{label} force", "N")
    largest = abs(gear * float(model.actuator_gainprm[index, 0]))
    return MeasuredAttribute(Attribute(name, unit, scale=1.0 / largest if largest > 0 else 1.0), read)


def _position(address: int, sign: float = 1.0, start: float = 0.0) -> Read:
    return lambda data: start + sign * float(data.qpos[address])


def _velocity(address: int, sign: float = 1.0) -> Read:
    return lambda data: sign * float(data.qvel[address])


def _angle(name: str, address: int, sign: float, start: float, limited: bool) -> MeasuredAttribute:
    turned = _position(address, sign, start)
    if limited:
        return MeasuredAttribute(Attribute(name, "rad"), turned)
    return MeasuredAttribute(Attribute(name, "rad", wraps=True), lambda data: wrap_angle(turned(data)))


def _speed(velocities: list[Read]) -> MeasuredAttribute:
    return MeasuredAttribute(
        Attribute("speed", "m/s"), lambda data: math.hypot(*(velocity(data) for velocity in velocities))
    )


def _label(model: mujoco.MjModel, joint: int) -> str:
    name: str = model.joint(joint).name
    return name.removesuffix("_joint") or f"joint {joint}"


def _unique(found: list[MeasuredAttribute]) -> tuple[MeasuredAttribute, ...]:
    """Names are addresses: where two would be one, a number tells them apart."""
    seen: Counter[str] = Counter()
    unique = []
    for one in found:
        name = one.attribute.name
        seen[name] += 1
        if seen[name] > 1:
            one = replace(one, attribute=replace(one.attribute, name=f"{name} {seen[name]}"))  # noqa: PLW2901
        unique.append(one)
    return tuple(unique)
