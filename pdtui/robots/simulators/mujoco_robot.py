"""What MuJoCo robots share: links from the model, poses, snapshots and digests from its data."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from hashlib import blake2b
from typing import Any, cast

import mujoco
import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.core.robot_data import Link, RobotState
from pdtui.robots.robot import Robot

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): ("capsule", 2),
    # A cylinder's rim rounds off; what is no primitive is drawn as the box around it.
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): ("capsule", 2),
    int(mujoco.mjtGeom.mjGEOM_SPHERE): ("sphere", 1),
    int(mujoco.mjtGeom.mjGEOM_BOX): ("box", 3),
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): ("box", 3),
    int(mujoco.mjtGeom.mjGEOM_MESH): ("box", 3),
}
_SILENT = 1_000_000
"""Count that tells MuJoCo it warned before: it prints and logs only the first warning of a kind."""
_DIVERGED = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)


def model_links(model: mujoco.MjModel) -> tuple[Link, ...]:
    """The model's visible geoms that belong to a body, as primitive shapes."""
    links = []
    for index in range(model.ngeom):
        geom = model.geom(index)
        body, kind = int(geom.bodyid[0]), int(geom.type[0])
        if body == 0 or kind not in _SHAPES or geom.rgba[3] == 0:
            continue
        shape, sizes = _SHAPES[kind]
        size = model.geom_aabb[index, 3:] if kind == mujoco.mjtGeom.mjGEOM_MESH else geom.size
        links.append(
            Link(
                name=geom.name or f"{model.body(body).name or f'body {body}'} {index}",
                body=body - 1,
                shape=cast(Any, shape),
                size=tuple(float(value) for value in size[:sizes]),
                position=cast(Any, tuple(float(value) for value in geom.pos)),
                quaternion=cast(Any, tuple(float(value) for value in geom.quat)),
            )
        )
    return tuple(links)


def state_of(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    """All that the next physics step reads, shape (S,)."""
    state = np.empty(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, state, _STATE)
    return state


def set_state(model: mujoco.MjModel, data: mujoco.MjData, state: Floats, owner: str) -> None:
    """Return to what `state_of` gave, bit-exactly.

    Raises:
        RobotError: the state has another size; the message names `owner`.
    """
    size = mujoco.mj_stateSize(model, _STATE)
    if state.shape != (size,):
        raise RobotError(f"{owner}: expected a state of {size} numbers, got {state.size}")
    mujoco.mj_setState(model, data, state, _STATE)
    mujoco.mj_forward(model, data)
    # mj_forward moves the solver's warm start, which the next step reads: put it back.
    mujoco.mj_setState(model, data, state, _STATE)
    silence_warnings(data)


@contextmanager
def ignored_warnings() -> Iterator[None]:
    """Take MuJoCo's warnings away from the process's handler of them while the block runs."""
    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda *_: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(handler)


def silence_warnings(data: mujoco.MjData) -> None:
    """Keep MuJoCo from printing warnings about this data until it is reset; `check_finite` reports them.

    The handler of warnings is the process's, and stays as it is.
    """
    for index in range(len(data.warning)):
        data.warning[index].number = _SILENT


def body_poses(data: mujoco.MjData) -> Floats:
    """World poses of all bodies but the world, from up-to-date kinematics, shape (B, 7)."""
    poses: Floats = np.concatenate((data.xpos[1:], data.xquat[1:]), axis=1)
    return poses


def digest_state(state: Floats) -> int:
    """A 63-bit digest of what `state_of` gave."""
    return int.from_bytes(blake2b(state.data, digest_size=8).digest(), "little") >> 1


def check_finite(data: mujoco.MjData, owner: str) -> None:
    """Raise where MuJoCo met a number it could not integrate.

    MuJoCo resets a diverged state by itself, so only its counters of warnings remember what happened.

    Raises:
        SimulationDiverged: the last steps were not finite; the message names `owner`.
    """
    for warning in _DIVERGED:
        if data.warning[int(warning)].number not in (0, _SILENT):
            quantity = warning.name.removeprefix("mjWARN_BAD").lower()
            raise SimulationDiverged(
                f"{owner}: the simulation diverged at {data.time:.2f} s "
                f"({quantity} is not finite or too large)"
            )


class GearedMotors:
    """Motors that turn joints, commanded between −1 and 1: a command's torque is the motor's gear times it.

    Attributes:
        joints: names of the joints, in the order of the motors.
        gears: largest torques, N m.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        motors = [model.actuator(index) for index in range(model.nu)]
        self.joints = [str(model.joint(int(motor.trnid[0])).name) for motor in motors]
        self.gears = [float(motor.gear[0]) for motor in motors]

    def torques(self, data: mujoco.MjData) -> list[float]:
        """Of the present commands, N m."""
        return [
            gear * min(1.0, max(-1.0, command))
            for gear, command in zip(self.gears, data.ctrl.tolist(), strict=True)
        ]


class MujocoRobot(Robot):
    """A robot whose simulator is a pair of `MjModel` and `MjData`."""

    model: mujoco.MjModel
    data: mujoco.MjData

    def read_poses(self) -> Floats:
        # After a step MuJoCo's poses are those of the state before its last substep.
        mujoco.mj_kinematics(self.model, self.data)
        return body_poses(self.data)

    def snapshot(self) -> RobotState:
        state = state_of(self.model, self.data)
        return RobotState(self.name, state, self._extras(), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        if snapshot.robot != self.name:
            raise RobotError(f"{self.name}: expected a snapshot of {self.name}, got one of {snapshot.robot}")
        set_state(self.model, self.data, snapshot.state, self.name)
        self._set_extras(snapshot.extras)
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return digest_state(self._state())

    def _state(self) -> Floats:
        """The state vector, in an array that the next call overwrites."""
        mujoco.mj_getState(self.model, self.data, self._state_buffer, _STATE)
        return self._state_buffer

    @cached_property
    def _state_buffer(self) -> Floats:
        return np.empty(mujoco.mj_stateSize(self.model, _STATE))

    def _extras(self) -> tuple[Floats, ...]:
        return ()

    def _set_extras(self, extras: tuple[Floats, ...]) -> None:
        del extras

    def _check_finite(self) -> None:
        check_finite(self.data, self.name)
