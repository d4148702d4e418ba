"""The world of a described legged robot: MuJoCo, joints held by position controllers, and commands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError
from pdtui.core.outcome import fall_info
from pdtui.core.robot_links_and_state import RobotState
from pdtui.robots.legged.legged_attributes import (
    compute_trunk_attributes,
    describe_attributes,
    read_trunk_attributes,
)
from pdtui.robots.legged.legged_observation_edits import legged_observation_edits
from pdtui.robots.legged.legged_robot_description import LeggedRobotDescription
from pdtui.robots.legged.legged_robot_state import LeggedRobotState, LeggedStateReader
from pdtui.robots.legged.mujoco_ground import lay_rough_ground, load_legged_model
from pdtui.robots.legged.observations_and_rewards import (
    compute_legged_observations,
    compute_legged_rewards,
    has_fallen,
)
from pdtui.robots.legged.terrain import RoughGround, draw_rough_ground
from pdtui.robots.lockstep.lockstep_legged_robots import LockstepLeggedRobots
from pdtui.robots.lockstep.lockstep_robots import LockstepRobots
from pdtui.robots.robot import ResetResult, StepResult
from pdtui.robots.simulators.mujoco_robot import MujocoRobot, read_model_links, silence_warnings

# Deviations at the start: of the yaw and the joints' angles (rad) and of all velocities (m/s, rad/s).
_START_NOISE = 0.1


class LeggedRobot(MujocoRobot):
    """A legged robot that follows commands; a class of its own states its `description`.

    The observation is that of `compute_legged_observations`, the reward that of `compute_legged_rewards`. The
    actions move the targets of the joints' PD controllers around the default. An episode ends with a fall.

    Attributes:
        description: What the robot is.
        commands: The commands that can be given, with their defaults. A policy may observe more numbers,
            which are 0.
        starts: ``plane`` and ``rough`` for a robot that also walks on rough ground.

    Args:
        random_commands: Whether every reset draws the commands, for training's scores.
        terrain: Ground on which it starts unless `reset` says otherwise.
        roughness: Largest height of rough ground, m.

    Raises:
        RobotError: There is no such terrain, or the model lacks something that the description names.
    """

    description: LeggedRobotDescription
    _action: Floats
    _last_action: Floats
    _foot_times: Floats
    state_arrays: tuple[str, ...] = ("_terrain_seed", "_command", "_action", "_last_action", "_foot_times")

    def __init__(self, random_commands: bool = False, terrain: str = "plane", roughness: float = 0.0) -> None:
        one, joints = self.description, len(self.description.default_angles)
        terrains = self.starts or ("plane",)
        if terrain not in terrains:
            raise RobotError(f"{self.name}: no terrain '{terrain}'; available: {', '.join(terrains)}")
        self._random_commands, self.terrain, self.roughness = random_commands, terrain, roughness
        self._rough = draw_rough_ground(np.random.default_rng(0), roughness) if self.starts else None
        self.model = self.load_model()
        self.data = mujoco.MjData(self.model)
        self.links = read_model_links(self.model)
        self.frame_skip = one.substeps
        self.action_space = spaces.Box(-one.max_action, one.max_action, (joints,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (one.observations,), np.float64)
        self._reader = LeggedStateReader(self.model, one)
        self.observation_edits = legged_observation_edits(one, self.joint_names())
        self._turn = "heading" if one.heading_gain else "yaw rate"
        self._command = np.array([self.commands.get(name, 0.0) for name in self.command_names])
        self._terrain_seed = np.zeros(2)
        self.ground: RoughGround | None = None
        self._stand_still()
        limits = self.model.actuator_forcerange[:, 1].tolist()
        self.attributes = describe_attributes(self.commands, self.joint_names(), limits)

    def load_model(self) -> mujoco.MjModel:
        """Return the model, with its grounds."""
        return load_legged_model(self.description.model, self._rough)

    def joint_names(self) -> tuple[str, ...]:
        """Return the joints' names in attributes; by default those of the model."""
        return tuple(self.model.joint(index).name for index in range(1, self.model.njnt))

    @property
    def command_names(self) -> tuple[str, str, str]:
        """Names of the commands in the order in which they are kept; one that cannot be given is 0."""
        return "forward", "lateral", self._turn

    def set_commands(self, values: Mapping[str, float]) -> bool:
        asked = np.array([values.get(name, 0.0) for name in self.command_names])
        if (asked == self._command).all():
            return False
        self._command = asked
        return True

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> ResetResult:
        """Stand, with joints up to 0.1 rad off the default and a yaw of up to ±0.1 rad.

        Args:
            seed: Seed of the start and of the ground.
            options: ``start``: one of `starts`.
        """
        super().reset(seed=seed)
        start = self.check_start(str((options or {}).get("start", ""))) or self.terrain
        rng, one = self.np_random, self.description
        if self.starts:
            self.lay_ground(self.starts.index(start), int(rng.integers(2**31)))
        mujoco.mj_resetData(self.model, self.data)
        silence_warnings(self.data)
        yaw = rng.uniform(-_START_NOISE, _START_NOISE)
        self.data.qpos[2] = one.start_height
        self.data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        self.data.qpos[7:] = one.stance + rng.uniform(-_START_NOISE, _START_NOISE, self.model.nu)
        self.data.qvel[:] = rng.uniform(-_START_NOISE, _START_NOISE, self.model.nv)
        self.data.ctrl[:] = one.stance
        self._stand_still()
        if self._random_commands:
            low, high = zip(*((one.low, one.high) for one in self.command_ranges.values()), strict=True)
            drawn = dict(zip(self.command_ranges, rng.uniform(low, high), strict=True))
            self._command = np.array(
                [drawn.get(name, 0.0) if name in self.commands else 0.0 for name in self.command_names]
            )
        mujoco.mj_forward(self.model, self.data)
        return self.observe(), {}

    def observe(self) -> Floats:
        observation: Floats = compute_legged_observations(self.read_state(), self.description)[0]
        return observation

    def step(self, action: NDArray[np.float32]) -> StepResult:
        one, dt = self.description, self.control_dt
        self._last_action, self._action = self._action, np.array(action, np.float64)
        self.data.ctrl[:] = one.stance + one.action_scale * self._action
        mujoco.mj_step(self.model, self.data, one.substeps)
        self._check_finite()
        motion = self.read_state()
        fell = has_fallen(motion, one.fall)
        reward, self._foot_times = compute_legged_rewards(motion, self._foot_times, dt, one, fell)
        info: dict[str, Any] = {"cost": 0.0}
        if fell[0]:
            info |= fall_info(f"fell: trunk at {self.data.qpos[2]:.2f} m")
        observation: Floats = compute_legged_observations(motion, one)[0]
        return observation, float(reward[0]), bool(fell[0]), False, info

    def read_attributes(self) -> Floats:
        x, y = self.data.qpos[:2].tolist()
        ground = self.ground.height(x, y) if self.ground is not None else 0.0
        trunk = read_trunk_attributes(self.data.qpos, self.data.qvel, ground)
        commands = self._command[[self.command_names.index(name) for name in self.commands]]
        return np.array([*trunk, *commands, *self.data.actuator_force.tolist()])

    def compute_attributes(self, motion: LeggedRobotState, commands: Floats) -> Floats:
        """Return what `read_attributes` would return in the states of n robots, shape (n, J), to rounding.

        Args:
            motion: The states.
            commands: The commands of each, in the order of `command_names`, shape (n, 3).
        """
        places = motion.qpos[:, None, :2]
        ground = np.zeros(len(places)) if self.ground is None else self.ground.heights_at(places)[:, 0]
        given = commands[:, [self.command_names.index(name) for name in self.commands]]
        return np.concatenate([compute_trunk_attributes(motion, ground), given, motion.torque], axis=1)

    def make_lockstep_robots(self, count: int) -> LockstepRobots | None:
        return LockstepLeggedRobots(self, count)

    def _stand_still(self) -> None:
        joints, feet = len(self.description.default_angles), len(self.description.feet)
        self._action, self._last_action = np.zeros(joints), np.zeros(joints)
        self._foot_times = np.zeros((1, 2, feet))

    def read_state(self) -> LeggedRobotState:
        """Return what observations and rewards are computed from, as the state of one robot."""
        data, actions = self.data, (self._action[None], self._last_action[None])
        motion = (data.qpos[None], data.qvel[None], actions, self._command[None])
        return self._read_motion(*motion, data.actuator_force[None], data.sensordata[None])

    def read_states(
        self, data: Sequence[mujoco.MjData], actions: tuple[Floats, Floats], commands: Floats
    ) -> LeggedRobotState:
        """Return the state of n copies of the robot that stand on its ground, as `read_state` does for one.

        Args:
            data: MuJoCo's data of each.
            actions: Actions of the last control step and of the one before, each of shape (n, A).
            commands: Commands, in the order of `command_names`, shape (n, 3).
        """
        motion = (np.array([one.qpos for one in data]), np.array([one.qvel for one in data]))
        forces = np.array([one.actuator_force for one in data])
        sensors = np.array([one.sensordata for one in data])
        return self._read_motion(*motion, actions, commands, forces, sensors)

    def read_controls(self) -> tuple[Floats, Floats, Floats]:
        """Return the last action, the one before, and the commands in the order of `command_names`."""
        return self._action, self._last_action, self._command

    def _read_motion(
        self,
        qpos: Floats,
        qvel: Floats,
        actions: tuple[Floats, Floats],
        commands: Floats,
        forces: Floats,
        sensors: Floats,
    ) -> LeggedRobotState:
        ground = None if self.ground is None else self.ground.heights_at
        return self._reader.read(qpos, qvel, actions, commands, forces, sensors, ground)

    def lay_ground(self, terrain: int, seed: int) -> None:
        """Lay the ground of a terrain, by its number, and of a seed."""
        if self.starts[terrain] != "rough":
            self.ground = None
        else:
            self.ground = draw_rough_ground(np.random.default_rng(seed), self.roughness)
        lay_rough_ground(self.model, self.ground)
        self._terrain_seed = np.array([terrain, seed], np.float64)

    def restore(self, snapshot: RobotState) -> None:
        self._check_snapshot(snapshot)
        if self.starts:
            terrain, seed = snapshot.extras[0].tolist()
            self.lay_ground(int(terrain), int(seed))
        super().restore(snapshot)

    def _copy_arrays(self) -> tuple[Floats, ...]:
        return (*super()._copy_arrays(), self.data.sensordata.copy(), self.data.actuator_force.copy())

    def _restore_arrays(self, arrays: tuple[Floats, ...]) -> None:
        super()._restore_arrays(arrays[:-2])
        self.data.sensordata[:], self.data.actuator_force[:] = arrays[-2:]
