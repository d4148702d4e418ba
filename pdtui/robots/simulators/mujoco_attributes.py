"""Kinematic attributes that follow from any MuJoCo model: of its root body, its joints and its motors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import mujoco
import numpy as np

from pdtui.core.attributes import Attribute, wrap_angle
from pdtui.robots.geometry import roll_pitch_yaw, rotate_vectors

_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_JOINT_MOTORS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
# Share of a direction along one axis from which on it counts as that axis.
_ALIGNED = 0.999
_VELOCITIES, _ANGLES, _AXES = ("vx", "vy", "vz"), ("roll", "pitch", "yaw"), "xyz"

Read = Callable[[mujoco.MjData], float]


@dataclass(frozen=True)
class AttributeReader:
    """An attribute, and the function that reads it from the simulator's data."""

    attribute: Attribute
    read: Read


def find_model_attributes(model: mujoco.MjModel) -> tuple[AttributeReader, ...]:
    """Return everything of a model that is worth measuring.

    The root is the heaviest moving tree of bodies. If it has a free joint, its attributes are ``vx``, ``vy``,
    ``vz``, ``speed`` (horizontal), ``height``, ``roll``, ``pitch``, ``yaw`` and their rates: yaw's about the
    vertical, the other two about the body's own axes. If it has slides along the axes and at most one hinge
    about one, as planar walkers do, it gets those of these attributes that it moves, and the position of a
    horizontal slide with limits. Every other joint gives its angle (or position) and velocity, and every
    motor its torque (or force) as MuJoCo last applied it.

    Angles without limits wrap at ±π. Scales are 1, because environments observe positions and velocities as
    they are; a motor's scale brings its torque to that of its control signal.
    """
    root = _find_root(model)
    own = [joint for joint in range(model.njnt) if model.jnt_bodyid[joint] == root]
    found = _free_root(model, own) or _planar_root(model, root, own)
    for joint in range(model.njnt):
        if not found or joint not in own:
            found += _joint(model, joint)
    return _number_duplicates(found + [_motor(model, index) for index in range(model.nu)])


def _find_root(model: mujoco.MjModel) -> int:
    trees = (body for body in range(1, model.nbody) if model.body_parentid[body] == 0)
    moving = (body for body in trees if model.body_jntnum[body])
    return max(moving, key=lambda body: float(model.body_subtreemass[body]), default=0)


def _free_root(model: mujoco.MjModel, own: list[int]) -> list[AttributeReader]:
    if not own or model.jnt_type[own[0]] != _FREE:
        return []
    q, v = int(model.jnt_qposadr[own[0]]), int(model.jnt_dofadr[own[0]])

    def angle(axis: int, data: mujoco.MjData) -> float:
        return roll_pitch_yaw(*data.qpos[q + 3 : q + 7].tolist())[axis]

    def yaw_rate(data: mujoco.MjData) -> float:
        # MuJoCo's angular velocity of a free joint is in the body's frame.
        return float(rotate_vectors(data.qpos[q + 3 : q + 7], data.qvel[v + 3 : v + 6])[2])

    linear = [_velocity(v + axis) for axis in range(3)]
    angles = [partial(angle, axis) for axis in range(3)]
    rates = [_velocity(v + 3), _velocity(v + 4), yaw_rate]
    return [
        *map(partial(_measure, "m/s"), _VELOCITIES, linear),
        _speed(linear[:2]),
        _measure("m", "height", _position(q + 2)),
        *(_measure("rad", name, read, name != "pitch") for name, read in zip(_ANGLES, angles, strict=True)),
        *(_measure("rad/s", f"{name} rate", read) for name, read in zip(_ANGLES, rates, strict=True)),
    ]


def _planar_root(model: mujoco.MjModel, root: int, own: list[int]) -> list[AttributeReader]:
    kinds = [int(model.jnt_type[joint]) for joint in own]
    # A slide after a hinge turns with it, and of two hinges neither is an angle against the world.
    ordered = kinds == sorted(kinds) and kinds.count(_HINGE) <= 1
    if _SLIDE not in kinds or not ordered or set(kinds) - {_SLIDE, _HINGE}:
        return []
    found: list[AttributeReader] = []
    horizontal: list[Read] = []
    for joint, kind in zip(own, kinds, strict=True):
        direction = rotate_vectors(model.body_quat[root], model.jnt_axis[joint])
        axis = int(np.argmax(np.abs(direction)))
        if abs(direction[axis]) < _ALIGNED:
            return []
        sign = math.copysign(1.0, float(direction[axis]))
        q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        start = -sign * float(model.qpos0[q])
        limited, velocity = bool(model.jnt_limited[joint]), _velocity(v, sign)
        if kind == _HINGE:
            found.append(_angle(_ANGLES[axis], q, sign, start, limited))
            found.append(_measure("rad/s", f"{_ANGLES[axis]} rate", velocity))
            continue
        found.append(_measure("m/s", _VELOCITIES[axis], velocity))
        position = _position(q, sign, start + float(model.body_pos[root][axis]))
        if axis == 2:
            found.append(_measure("m", "height", position))
            continue
        horizontal.append(velocity)
        if limited:
            found.append(_measure("m", _AXES[axis], position))
    return [*found, _speed(horizontal)] if horizontal else found


def _joint(model: mujoco.MjModel, joint: int) -> list[AttributeReader]:
    label, kind = _label(model, joint), int(model.jnt_type[joint])
    q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    if kind == _HINGE:
        angle = _angle(f"{label} angle", q, 1.0, 0.0, bool(model.jnt_limited[joint]))
        return [angle, _measure("rad/s", f"{label} velocity", _velocity(v))]
    if kind == _SLIDE:
        position = _measure("m", f"{label} position", _position(q))
        return [position, _measure("m/s", f"{label} velocity", _velocity(v))]
    if kind == _BALL:
        names = (f"{label} velocity {axis}" for axis in _AXES)
        return [_measure("rad/s", name, _velocity(v + axis)) for axis, name in enumerate(names)]
    return [_measure("m", f"{label} {name}", _position(q + axis)) for axis, name in enumerate(_AXES)]


def _motor(model: mujoco.MjModel, index: int) -> AttributeReader:
    motor = model.actuator(index)
    turns, gear, label = False, 1.0, motor.name or f"motor {index}"
    if int(model.actuator_trntype[index]) in _JOINT_MOTORS:
        joint = int(model.actuator_trnid[index, 0])
        turns, gear = int(model.jnt_type[joint]) == _HINGE, float(model.actuator_gear[index, 0])
        label = motor.name or _label(model, joint)

    def read(data: mujoco.MjData) -> float:
        return gear * float(data.actuator_force[index])

    name, unit = (f"{label} torque", "N m") if turns else (f"{label} force", "N")
    largest = abs(gear * float(model.actuator_gainprm[index, 0]))
    return AttributeReader(Attribute(name, unit, scale=1.0 / largest if largest > 0 else 1.0), read)


def _measure(unit: str, name: str, read: Read, wraps: bool = False) -> AttributeReader:
    return AttributeReader(Attribute(name, unit, wraps=wraps), read)


def _position(address: int, sign: float = 1.0, start: float = 0.0) -> Read:
    return lambda data: start + sign * float(data.qpos[address])


def _velocity(address: int, sign: float = 1.0) -> Read:
    return lambda data: sign * float(data.qvel[address])


def _angle(name: str, address: int, sign: float, start: float, limited: bool) -> AttributeReader:
    turned = _position(address, sign, start)
    return _measure("rad", name, turned if limited else lambda data: wrap_angle(turned(data)), not limited)


def _speed(velocities: Sequence[Read]) -> AttributeReader:
    return _measure("m/s", "speed", lambda data: math.hypot(*(velocity(data) for velocity in velocities)))


def _label(model: mujoco.MjModel, joint: int) -> str:
    name: str = model.joint(joint).name
    return name.removesuffix("_joint") or f"joint {joint}"


def _number_duplicates(found: list[AttributeReader]) -> tuple[AttributeReader, ...]:
    """Append a number to each name that is there already, since names are addresses."""
    seen: Counter[str] = Counter()
    unique = []
    for measured in found:
        attribute = measured.attribute
        seen[attribute.name] += 1
        if (number := seen[attribute.name]) > 1:
            attribute = replace(attribute, name=f"{attribute.name} {number}")
        unique.append(AttributeReader(attribute, measured.read))
    return tuple(unique)
