"""ANYmal-C in MuJoCo: a quadruped whose policy follows commands, and a variant with one command."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.outcome import fall_info
from pdtui.core.robot_links_and_state import CommandRange, Foot
from pdtui.robots.geometry import roll_pitch_yaw, rotate_vectors
from pdtui.robots.legged.legged_observation_edits import TRUNK_EDITS, command_edits
from pdtui.robots.legged.observations_and_rewards import (
    COMMAND_SCALES,
    LeggedRobotState,
    compute_legged_observations,
    compute_legged_rewards,
    has_fallen,
)
from pdtui.robots.robot import ResetResult, StepResult, TrainingRecipe
from pdtui.robots.simulators.mujoco_robot import MujocoRobot, read_model_links, silence_warnings

MODEL = Path(__file__).parent / "models" / "anymal_c.xml"
LEGS = ("LF", "LH", "RF", "RH")
COMMANDS = {"forward": "m/s", "lateral": "m/s", "yaw rate": "rad/s"}
"""All commands and their units, in the order in which policies observe them."""
DEFAULT_ANGLES = np.array([0.0, 0.4, -0.8, 0.0, -0.4, 0.8] * 2)
"""Joint angles at action 0, rad: hip, thigh and knee of each of `LEGS`."""
ACTION_SCALE = 0.5
"""Change of a joint's target angle per unit of action, rad."""
SUBSTEPS = 4
"""Physics steps per control step."""
START_HEIGHT, TARGET_HEIGHT = 0.55, 0.52
"""Height of the trunk at the start, and the height that training rewards, m."""
_JOINTS = ("hip", "thigh", "knee")
_MAX_ACTION = 2.0
_MAX_TORQUE = 80.0  # N m
# Deviations at the start: of the yaw and the joints' angles (rad) and of all velocities (m/s, rad/s).
_START_NOISE = 0.1


def foot_sensor_slices(model: mujoco.MjModel) -> tuple[slice, slice]:
    """Return which sensor values are the positions of the feet, and which their velocities."""
    first, second = (int(model.sensor(name).adr[0]) for name in ("LF", "LF_velocity"))
    return slice(first, first + 12), slice(second, second + 12)


class Anymal(MujocoRobot):
    """ANYmal-C on a plane; a control step is 0.02 s.

    The observation has 49 numbers, or 47 with the forward command alone; see
    `compute_legged_observations`. The 12 actions move the targets of the joints' PD controllers by 0.5 rad
    each around the default. The reward is that of following the commands; see `compute_legged_rewards`. An
    episode ends when the trunk is on the ground or on its side.

    Attributes:
        commands: Those of `COMMANDS` that the policy observes, m/s and rad/s.

    Args:
        random_commands: Whether every reset draws the commands, for training's scores, instead of commanding
            1 m/s forward.
    """

    name = "anymal"
    title = "ANYmal-C (MuJoCo)"
    frame_skip = SUBSTEPS
    feet = (
        Foot("LF", "LF_FOOT", "front left"),
        Foot("RF", "RF_FOOT", "front right"),
        Foot("LH", "LH_FOOT", "rear left"),
        Foot("RH", "RH_FOOT", "rear right"),
    )
    _action: Floats
    _last_action: Floats
    _air_time: Floats
    state_arrays = ("_command", "_action", "_last_action", "_air_time")
    training_recipe = TrainingRecipe(
        options={"random_commands": True},
        settings={
            "worlds": 256,
            "minibatch": 2048,
            "layers": (128, 64, 32),
            "reward_scale": 2.0,
            "entropy": 0.004,
            "evaluate_every": 1_000_000,
            "evaluate_steps": 500,
        },
        robot_batch="pdtui.training.anymal_batch:AnymalBatch",
    )
    commands: Mapping[str, float] = MappingProxyType({"forward": 1.0, "lateral": 0.0, "yaw rate": 0.0})
    command_ranges = MappingProxyType(
        {
            "forward": CommandRange("forward", -0.3, 1.4),
            "lateral": CommandRange("sideways", -0.3, 0.3),
            "yaw rate": CommandRange("yaw rate", -1.0, 1.0),
        }
    )

    def __init__(self, random_commands: bool = False) -> None:
        self._random_commands = random_commands
        self.model = mujoco.MjModel.from_xml_path(str(MODEL))
        self.data = mujoco.MjData(self.model)
        self.links = read_model_links(self.model)
        self.action_space = spaces.Box(-_MAX_ACTION, _MAX_ACTION, (12,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (46 + len(self.commands),), np.float64)
        self._feet, self._feet_velocity = foot_sensor_slices(self.model)
        self.observation_edits = (*TRUNK_EDITS, *command_edits(self.commands))
        self._command = np.array([1.0, 0.0, 0.0])
        self._stand_still()
        torque_scale = 1.0 / _MAX_TORQUE
        self.attributes = (
            Attribute("vx", "m/s"),
            Attribute("vy", "m/s"),
            Attribute("speed", "m/s"),
            Attribute("forward", "m/s", scale=float(COMMAND_SCALES[0])),
            Attribute("sideways", "m/s", scale=float(COMMAND_SCALES[1])),
            Attribute("yaw", "rad", wraps=True),
            Attribute("yaw rate", "rad/s", scale=float(COMMAND_SCALES[2])),
            Attribute("roll", "rad", wraps=True),
            Attribute("pitch", "rad"),
            Attribute("height", "m"),
            *(Attribute(f"{name} command", COMMANDS[name]) for name in self.commands),
            *(Attribute(f"{leg} {joint} torque", "N m", torque_scale) for leg in LEGS for joint in _JOINTS),
        )

    def set_commands(self, values: Mapping[str, float]) -> bool:
        asked = np.array([values.get(name, 0.0) for name in COMMANDS])
        if (asked == self._command).all():
            return False
        self._command = asked
        return True

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> ResetResult:
        """Stand, with joints up to 0.1 rad off the default and a yaw of up to ±0.1 rad."""
        super().reset(seed=seed)
        del options
        rng = self.np_random
        mujoco.mj_resetData(self.model, self.data)
        silence_warnings(self.data)
        yaw = rng.uniform(-_START_NOISE, _START_NOISE)
        self.data.qpos[2] = START_HEIGHT
        self.data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        self.data.qpos[7:] = DEFAULT_ANGLES + rng.uniform(-_START_NOISE, _START_NOISE, 12)
        self.data.qvel[:] = rng.uniform(-_START_NOISE, _START_NOISE, 18)
        self.data.ctrl[:] = DEFAULT_ANGLES
        self._stand_still()
        if self._random_commands:
            low, high = zip(*((one.low, one.high) for one in self.command_ranges.values()), strict=True)
            drawn = rng.uniform(low, high)
            self._command[:] = np.where(np.arange(3) < len(self.commands), drawn, 0.0)
        mujoco.mj_forward(self.model, self.data)
        return self.observe(), {}

    def observe(self) -> Floats:
        observation: Floats = compute_legged_observations(self._motion(), DEFAULT_ANGLES, len(self.commands))[
            0
        ]
        return observation

    def step(self, action: NDArray[np.float32]) -> StepResult:
        self._last_action, self._action = self._action, np.array(action, np.float64)
        self.data.ctrl[:] = DEFAULT_ANGLES + ACTION_SCALE * self._action
        mujoco.mj_step(self.model, self.data, SUBSTEPS)
        self._check_finite()
        motion, dt = self._motion(), self.control_dt
        reward, self._air_time = compute_legged_rewards(
            motion, self._air_time, dt, TARGET_HEIGHT, DEFAULT_ANGLES
        )
        info: dict[str, Any] = {"cost": 0.0}
        fell = bool(has_fallen(motion)[0])
        if fell:
            info |= fall_info(f"fell: trunk at {self.data.qpos[2]:.2f} m")
        observation: Floats = compute_legged_observations(motion, DEFAULT_ANGLES, len(self.commands))[0]
        return observation, float(reward[0]), fell, False, info

    def read_attributes(self) -> Floats:
        vx, vy = self.data.qvel[:2].tolist()
        roll, pitch, yaw = roll_pitch_yaw(*self.data.qpos[3:7].tolist())
        forward, sideways = math.cos(yaw) * vx + math.sin(yaw) * vy, math.cos(yaw) * vy - math.sin(yaw) * vx
        yaw_rate = float(rotate_vectors(self.data.qpos[3:7], self.data.qvel[3:6])[2])
        commands = self._command[[list(COMMANDS).index(name) for name in self.commands]]
        height, torques = float(self.data.qpos[2]), self.data.actuator_force.tolist()
        moves = (vx, vy, math.hypot(vx, vy), forward, sideways, yaw, yaw_rate, roll, pitch, height)
        return np.array([*moves, *commands, *torques])

    def _stand_still(self) -> None:
        self._action, self._last_action, self._air_time = np.zeros(12), np.zeros(12), np.zeros((1, 4))

    def _motion(self) -> LeggedRobotState:
        sensors = self.data.sensordata
        feet = (sensors[part].reshape(1, 4, 3) for part in (self._feet, self._feet_velocity))
        physics = (self.data.qpos, self.data.qvel, self._action, self._last_action, self._command)
        rows = (array[None] for array in (*physics, self.data.actuator_force))
        return LeggedRobotState(*rows, *feet)

    def _copy_arrays(self) -> tuple[Floats, ...]:
        return (*super()._copy_arrays(), self.data.sensordata.copy(), self.data.actuator_force.copy())

    def _restore_arrays(self, arrays: tuple[Floats, ...]) -> None:
        super()._restore_arrays(arrays[:-2])
        self.data.sensordata[:], self.data.actuator_force[:] = arrays[-2:]


class AnymalForward(Anymal):
    """ANYmal-C whose policy observes the forward command alone: it was never commanded to turn."""

    name = "anymal-forward"
    title = "ANYmal-C, forward only (MuJoCo)"
    commands = MappingProxyType({"forward": 1.0})
