"""What MuJoCo robots share: links from the model, poses, snapshots and digests from its data."""

from __future__ import annotations

from functools import cached_property
from hashlib import blake2b
from typing import Any, cast

import mujoco
import numpy as np

from pdtui.errors import RobotError, SimulationDiverged
from pdtui.robots.base import Robot
from pdtui.robots.types import Floats, Link, RobotSnapshot

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): ("capsule", 2),
    int(mujoco.mjtGeom.mjGEOM_SPHERE): ("sphere", 1),
    int(mujoco.mjtGeom.mjGEOM_BOX): ("box", 3),
}
# Its own handler prints and leaves a log file in the user's folder; `_check_finite` says what matters.
mujoco.set_mju_user_warning(lambda *_: None)
_DIVERGED = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)


def links_of(model: mujoco.MjModel) -> tuple[Link, ...]:
    """The model's capsules, spheres and boxes that move with a body."""
    links = []
    for index in range(model.ngeom):
        geom = model.geom(index)
        body, kind = int(geom.bodyid[0]), int(geom.type[0])
        if body == 0 or kind not in _SHAPES:
            continue
        shape, sizes = _SHAPES[kind]
        links.append(
            Link(
                name=geom.name or f"{model.body(body).name or f'body {body}'} {index}",
                body=body - 1,
                shape=cast(Any, shape),
                size=tuple(float(value) for value in geom.size[:sizes]),
                position=cast(Any, tuple(float(value) for value in geom.pos)),
                quaternion=cast(Any, tuple(float(value) for value in geom.quat)),
            )
        )
    return tuple(links)


class MujocoRobot(Robot):
    """A robot whose simulator is a pair of `MjModel` and `MjData`."""

    model: mujoco.MjModel
    data: mujoco.MjData

    def read_poses(self) -> Floats:
        # After a step MuJoCo's poses are those of the state before its last substep.
        mujoco.mj_kinematics(self.model, self.data)
        poses: Floats = np.concatenate((self.data.xpos[1:], self.data.xquat[1:]), axis=1)
        return poses

    def snapshot(self) -> RobotSnapshot:
        random = self.np_random.bit_generator.state
        return RobotSnapshot(self.name, self._state().copy(), self._extras(), random)

    def restore(self, snapshot: RobotSnapshot) -> None:
        size = self._state_buffer.size
        if snapshot.robot != self.name or snapshot.state.shape != (size,):
            raise RobotError(
                f"{self.name}: expected a snapshot of {self.name} with {size} numbers, got one of "
                f"{snapshot.robot} with {snapshot.state.size}"
            )
        mujoco.mj_setState(self.model, self.data, snapshot.state, _STATE)
        mujoco.mj_forward(self.model, self.data)
        # mj_forward moves the solver's warm start, which the next step reads: put it back.
        mujoco.mj_setState(self.model, self.data, snapshot.state, _STATE)
        for index in range(len(self.data.warning)):
            self.data.warning[index].number = 0
        self._set_extras(snapshot.extras)
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return int.from_bytes(blake2b(self._state().data, digest_size=8).digest(), "little") >> 1

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
        """Raise where MuJoCo met a number it could not integrate.

        MuJoCo resets a diverged state by itself, so only its warning counters remember what happened.

        Raises:
            SimulationDiverged: the last steps were not finite.
        """
        for warning in _DIVERGED:
            if self.data.warning[int(warning)].number:
                quantity = warning.name.removeprefix("mjWARN_BAD").lower()
                raise SimulationDiverged(
                    f"{self.name}: the simulation diverged at {self.data.time:.2f} s "
                    f"({quantity} is not finite or too large)"
                )
