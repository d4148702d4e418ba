"""What MuJoCo robots share: links from the model; poses, snapshots and digests from its data."""

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
from pdtui.core.robot_links_and_state import Link, RobotState
from pdtui.robots.legged.foot_contacts import read_mujoco_contacts
from pdtui.robots.robot import Robot
from pdtui.robots.simulators.mujoco_disturbances import find_push_directions, push_root, scale_model

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): ("capsule", 2),
    # A cylinder is drawn with round ends, and a shape that is no primitive as the box around it.
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): ("capsule", 2),
    int(mujoco.mjtGeom.mjGEOM_SPHERE): ("sphere", 1),
    int(mujoco.mjtGeom.mjGEOM_BOX): ("box", 3),
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): ("box", 3),
    int(mujoco.mjtGeom.mjGEOM_MESH): ("box", 3),
}
# MuJoCo prints and logs only the first warning of a kind: a count above 0 keeps it silent.
_SILENT = 1_000_000
_DIVERGENCE_WARNINGS = {
    "qpos": mujoco.mjtWarning.mjWARN_BADQPOS,
    "qvel": mujoco.mjtWarning.mjWARN_BADQVEL,
    "qacc": mujoco.mjtWarning.mjWARN_BADQACC,
}


def read_model_links(model: mujoco.MjModel) -> tuple[Link, ...]:
    """Return the visible geoms of all bodies but the world, as primitive shapes."""
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
                geom.name or f"{model.body(body).name or f'body {body}'} {index}",
                body - 1,
                cast(Any, shape),
                *(tuple(values.tolist()) for values in (size[:sizes], geom.pos, geom.quat)),
            )
        )
    return tuple(links)


def read_mujoco_state(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    """Return everything that the next physics step reads, shape (S,)."""
    state = np.empty(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, state, _STATE)
    return state


def write_mujoco_state(model: mujoco.MjModel, data: mujoco.MjData, state: Floats, owner: str) -> None:
    """Restore what `read_mujoco_state` returned, bit-exactly.

    Raises:
        RobotError: The state has another size; the message names `owner`.
    """
    size = mujoco.mj_stateSize(model, _STATE)
    if state.shape != (size,):
        raise RobotError(f"{owner}: expected a state of {size} numbers, got {state.size}")
    mujoco.mj_setState(model, data, state, _STATE)
    mujoco.mj_forward(model, data)
    # mj_forward changes the solver's warm start, which the next step reads.
    mujoco.mj_setState(model, data, state, _STATE)
    silence_warnings(data)


@contextmanager
def suppress_warnings() -> Iterator[None]:
    """Drop MuJoCo's warnings while the block runs, instead of passing them to the process's handler."""
    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda *_: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(handler)


def silence_warnings(data: mujoco.MjData) -> None:
    """Keep MuJoCo from printing warnings about this data until it is reset; `check_state_is_finite` reports
    them.

    The process's handler of warnings stays as it is.
    """
    for index in range(len(data.warning)):
        data.warning[index].number = _SILENT


def read_body_poses(data: mujoco.MjData) -> Floats:
    """Return the poses of all bodies but the world, from up-to-date kinematics, shape (B, 7)."""
    poses: Floats = np.concatenate((data.xpos[1:], data.xquat[1:]), axis=1)
    return poses


def digest_simulator_state(state: Floats) -> int:
    """Return a 63-bit digest of what `read_mujoco_state` returned."""
    return int.from_bytes(blake2b(state.data, digest_size=8).digest(), "little") >> 1


def check_state_is_finite(data: mujoco.MjData, owner: str) -> None:
    """Check that the simulation did not diverge.

    MuJoCo resets a diverged state by itself, so only its warning counters tell.

    Raises:
        SimulationDiverged: The last steps were not finite; the message names `owner`.
    """
    for quantity, warning in _DIVERGENCE_WARNINGS.items():
        if data.warning[int(warning)].number not in (0, _SILENT):
            raise SimulationDiverged(
                f"{owner}: the simulation diverged at {data.time:.2f} s "
                f"({quantity} is not finite or too large)"
            )


def read_motor_gears(model: mujoco.MjModel) -> dict[str, float]:
    """Return the gear of every motor by the name of its joint: its torque for a command of 1, N m."""
    motors = (model.actuator(index) for index in range(model.nu))
    return {str(model.joint(int(motor.trnid[0])).name): float(motor.gear[0]) for motor in motors}


class MujocoRobot(Robot):
    """A robot whose simulator is a pair of `MjModel` and `MjData`.

    Attributes:
        frame_skip: Physics steps per control step.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    frame_skip: int

    @property
    def control_dt(self) -> float:
        return float(self.model.opt.timestep) * self.frame_skip

    def read_poses(self) -> Floats:
        # After a step, MuJoCo's poses are those of the state before the last physics step.
        mujoco.mj_kinematics(self.model, self.data)
        return read_body_poses(self.data)

    def read_foot_contacts(self) -> list[bool]:
        return read_mujoco_contacts(self.model, self.data, self.feet)

    def snapshot(self) -> RobotState:
        state = read_mujoco_state(self.model, self.data)
        return RobotState(self.name, state, self._copy_arrays(), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self._check_snapshot(snapshot)
        write_mujoco_state(self.model, self.data, snapshot.state, self.name)
        self._restore_arrays(snapshot.extras)
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        mujoco.mj_getState(self.model, self.data, self._state_buffer, _STATE)
        return digest_simulator_state(self._state_buffer)

    @property
    def offers_pushes(self) -> bool:
        return bool(find_push_directions(self.model))

    def push_trunk(self, vx: float, vy: float) -> None:
        if not self.offers_pushes:
            super().push_trunk(vx, vy)
        push_root(self.model, self.data, vx, vy)

    @property
    def offers_scaled_physics(self) -> bool:
        return True

    @contextmanager
    def scaled_physics(self, friction: float, mass: float) -> Iterator[None]:
        own = self.model
        self.model = scale_model(own, friction, mass)
        try:
            yield
        finally:
            self.model = own

    @cached_property
    def _state_buffer(self) -> Floats:
        return np.empty(mujoco.mj_stateSize(self.model, _STATE))

    def _check_finite(self) -> None:
        check_state_is_finite(self.data, self.name)
