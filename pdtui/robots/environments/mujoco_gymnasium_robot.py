"""Any Gymnasium environment on MuJoCo: its model gives attributes, links, poses and snapshots."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium
import mujoco
import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.robots.environments.gymnasium_robot import GymnasiumRobot
from pdtui.robots.legged.foot_contacts import read_mujoco_contacts
from pdtui.robots.options.robot_option import NO_ROBOT_OPTIONS, RobotOptions
from pdtui.robots.robot import ResetResult
from pdtui.robots.simulators import mujoco_robot
from pdtui.robots.simulators.mujoco_attributes import find_model_attributes
from pdtui.robots.simulators.mujoco_disturbances import find_push_directions, push_root, scale_model


def is_mujoco(env: gymnasium.Env[Any, Any]) -> bool:
    """Return whether an environment exposes its MuJoCo model and data, as Gymnasium's `MujocoEnv` does."""
    world: Any = env.unwrapped
    kinds = {"model": mujoco.MjModel, "data": mujoco.MjData}
    return all(isinstance(getattr(world, name, None), kind) for name, kind in kinds.items())


class MujocoGymnasiumRobot(GymnasiumRobot):
    """An environment whose ``unwrapped`` has a ``model`` and ``data`` of MuJoCo.

    The last attribute is the environment's reward. A snapshot holds what the next physics step reads, the
    quantities that MuJoCo derived in the last one (observations and rewards read them one physics step old),
    and the Python state. Restoring computes the contacts anew.
    """

    _scales: tuple[float, float] | None = None  # on friction and masses

    def __init__(
        self, name: str, title: str = "", environment: str = "", options: RobotOptions = NO_ROBOT_OPTIONS
    ) -> None:
        super().__init__(name, title, environment, options)
        model = self.world.model
        self._measured = find_model_attributes(model)
        self.attributes = (*(one.attribute for one in self._measured), Attribute("reward", ""))
        self.links = mujoco_robot.read_model_links(model)
        fresh = mujoco.MjData(model)
        self._derived = tuple(name for name in dir(fresh) if _is_derived(getattr(fresh, name)))
        self._posed = fresh

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> ResetResult:
        first = super().reset(seed=seed, options=options)
        mujoco_robot.silence_warnings(self.world.data)
        return first

    def make_world(self) -> gymnasium.Env[Any, Any]:
        with mujoco_robot.suppress_warnings():  # they are advice to the model's author
            env = super().make_world()
        if self._scales is not None:
            world: Any = env.unwrapped
            world.model = scale_model(world.model, *self._scales)
        return env

    @property
    def offers_pushes(self) -> bool:
        return bool(find_push_directions(self.world.model))

    def push_trunk(self, vx: float, vy: float) -> None:
        if not self.offers_pushes:
            super().push_trunk(vx, vy)
        self._actions.append_push(vx, vy)
        push_root(self.world.model, self.world.data, vx, vy)

    @property
    def offers_scaled_physics(self) -> bool:
        return True

    @contextmanager
    def scaled_physics(self, friction: float, mass: float) -> Iterator[None]:
        world = self.world
        own, before = world.model, self._scales
        self._scales = (friction, mass)  # for environments that a reset makes anew
        world.model = scale_model(own, friction, mass)
        try:
            yield
        finally:
            world.model, self._scales = own, before

    @property
    def control_dt(self) -> float:
        dt = getattr(self.world, "dt", None)
        if isinstance(dt, float):
            return dt
        return float(self.world.model.opt.timestep) * int(getattr(self.world, "frame_skip", 1))

    def read_attributes(self) -> Floats:
        data = self.world.data
        return np.array([*(one.read(data) for one in self._measured), self.reward], np.float64)

    def read_poses(self) -> Floats:
        # Environments derive velocities from poses that are one physics step old, so compute in other data.
        world, posed = self.world, self._posed
        posed.qpos[:], posed.mocap_pos[:] = world.data.qpos, world.data.mocap_pos
        posed.mocap_quat[:] = world.data.mocap_quat
        mujoco.mj_kinematics(world.model, posed)
        return mujoco_robot.read_body_poses(posed)

    def read_foot_contacts(self) -> list[bool]:
        return read_mujoco_contacts(self.world.model, self.world.data, self.feet)

    def digest(self) -> int:
        if self._repeats:
            return super().digest()
        return mujoco_robot.digest_simulator_state(
            mujoco_robot.read_mujoco_state(self.world.model, self.world.data)
        )

    def _restored_apart(self) -> tuple[type, ...]:
        from gymnasium.envs.mujoco.mujoco_rendering import MujocoRenderer

        return (mujoco.MjModel, mujoco.MjData, MujocoRenderer)

    def _simulator_state(self) -> tuple[Floats, tuple[Floats, ...]]:
        data = self.world.data
        derived = np.concatenate([getattr(data, name).ravel() for name in self._derived])
        return mujoco_robot.read_mujoco_state(self.world.model, data), (derived,)

    def _set_simulator_state(self, state: Floats, extras: tuple[Floats, ...]) -> None:
        data = self.world.data
        mujoco_robot.write_mujoco_state(self.world.model, data, state, self.name)
        done = 0
        for name in self._derived:
            values = getattr(data, name)
            values[...] = extras[0][done : done + values.size].reshape(values.shape)
            done += values.size

    def _check_finite(self) -> None:
        mujoco_robot.check_state_is_finite(self.world.data, self.name)
        super()._check_finite()


def _is_derived(values: object) -> bool:
    """Return whether a field of new data holds numbers of a fixed count; fields of contacts do not."""
    return isinstance(values, np.ndarray) and values.dtype == np.float64 and values.size > 0
