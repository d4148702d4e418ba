"""ANYmal-C in MuJoCo: a quadruped whose policy follows commands."""

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
from pdtui.core.robot_data import CommandRange
from pdtui.robots.geometry import roll_pitch_yaw, rotate
from pdtui.robots.legged.legged_rewards import (
    COMMAND_SCALES,
    LeggedMotion,
    RewardWeights,
    fallen,
    legged_observations,
    legged_rewards,
)
from pdtui.robots.robot_goals import WALKING_GOALS
from pdtui.robots.simulators.mujoco_robot import MujocoRobot, model_links, silence_warnings
from pdtui.robots.training_recipe import TrainingRecipe

MODEL = Path(__file__).parent / "models" / "anymal_c.xml"
LEGS = ("LF", "LH", "RF", "RH")
COMMANDS = ("forward", "lateral", "yaw rate")
DEFAULT = np.array([0.0, 0.4, -0.8, 0.0, -0.4, 0.8] * 2)
"""Joint angles around which actions move, LF LH RF RH, each hip, thigh, knee; rad."""
ACTION_SCALE = 0.5
SUBSTEPS = 4
HEIGHT = 0.52
"""What training asks of the trunk, m."""
_JOINTS = ("hip", "thigh", "knee")
_MOST = 2.0


def feet_of(model: mujoco.MjModel) -> tuple[slice, slice]:
    """Where the sensors of the feet are: positions, then velocities."""
    first, second = (int(model.sensor(name).adr[0]) for name in ("LF", "LF_velocity"))
    return slice(first, first + 12), slice(second, second + 12)


class Anymal(MujocoRobot):
    """ANYmal-C on a plane; 0.02 s a control step (4 physics steps).

    Observation (49, or 47 with the forward command alone): see `legged.observations`. The 12 actions move the
    targets of the joints' PD by 0.5 rad each around the default. Reward is what training pays for following
    the command (see `legged.rewards`). An episode ends where the trunk is on the ground or on its side.

    Attributes:
        commands: what the policy can be asked for, of `COMMANDS`, m/s and rad/s; it sees no others.

    Args:
        random_commands: for training's scores: every reset draws commands, instead of 1 m/s forward.
    """

    name = "anymal"
    title = "ANYmal-C (MuJoCo)"
    goals = WALKING_GOALS
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
        world_batch="pdtui.training.anymal_worlds:AnymalWorldBatch",
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
        self.links = model_links(self.model)
        self.action_space = spaces.Box(-_MOST, _MOST, (12,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (46 + len(self.commands),), np.float64)
        self._feet, self._feet_velocity = feet_of(self.model)
        self._weights = RewardWeights()
        self._command = np.array([1.0, 0.0, 0.0])
        self._action, self._last_action = np.zeros(12), np.zeros(12)
        self._air_time = np.zeros((1, 4))
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
            *(Attribute(f"{name} command", unit) for name, unit in self._command_units()),
            *(Attribute(f"{leg} {joint} torque", "N m", scale=1 / 80) for leg in LEGS for joint in _JOINTS),
        )

    @property
    def control_dt(self) -> float:
        return SUBSTEPS * float(self.model.opt.timestep)

    def set_commands(self, values: Mapping[str, float]) -> bool:
        asked = np.array([values.get(name, 0.0) for name in COMMANDS])
        if (asked == self._command).all():
            return False
        self._command = asked
        return True

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Stand, joints up to 0.1 rad off the default, facing anywhere within ±0.1 rad of +x."""
        super().reset(seed=seed)
        del options
        rng = self.np_random
        mujoco.mj_resetData(self.model, self.data)
        silence_warnings(self.data)
        yaw = rng.uniform(-0.1, 0.1)
        self.data.qpos[2] = 0.55
        self.data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        self.data.qpos[7:] = DEFAULT + rng.uniform(-0.1, 0.1, 12)
        self.data.qvel[:] = rng.uniform(-0.1, 0.1, 18)
        self.data.ctrl[:] = DEFAULT
        self._action, self._last_action = np.zeros(12), np.zeros(12)
        self._air_time = np.zeros((1, 4))
        if self._random_commands:
            low, high = zip(*((one.low, one.high) for one in self.command_ranges.values()), strict=True)
            drawn = rng.uniform(low, high)
            self._command[:] = np.where(np.arange(3) < len(self.commands), drawn, 0.0)
        mujoco.mj_forward(self.model, self.data)
        return self.observe(), {}

    def observe(self) -> Floats:
        seen: Floats = legged_observations(self._motion(), DEFAULT, len(self.commands))[0]
        return seen

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        self._last_action, self._action = self._action, np.array(action, np.float64)
        self.data.ctrl[:] = DEFAULT + ACTION_SCALE * self._action
        mujoco.mj_step(self.model, self.data, SUBSTEPS)
        self._check_finite()
        motion = self._motion()
        paid, self._air_time = legged_rewards(
            motion, self._air_time, self.control_dt, HEIGHT, DEFAULT, self._weights
        )
        info: dict[str, Any] = {"cost": 0.0}
        fell = bool(fallen(motion)[0])
        if fell:
            info["reason"] = f"fell: trunk at {self.data.qpos[2]:.2f} m"
        return legged_observations(motion, DEFAULT, len(self.commands))[0], float(paid[0]), fell, False, info

    def read_attributes(self) -> Floats:
        vx, vy, _, a, b, c = self.data.qvel[:6].tolist()
        w, x, y, z = self.data.qpos[3:7].tolist()
        roll, pitch, yaw = roll_pitch_yaw(w, x, y, z)
        forward, sideways = math.cos(yaw) * vx + math.sin(yaw) * vy, math.cos(yaw) * vy - math.sin(yaw) * vx
        yaw_rate = float(rotate(self.data.qpos[3:7], np.array([a, b, c]))[2])
        commands = [self._command[COMMANDS.index(name)] for name in self.commands]
        height, torques = float(self.data.qpos[2]), self.data.actuator_force.tolist()
        moves = (vx, vy, math.hypot(vx, vy), forward, sideways, yaw, yaw_rate, roll, pitch, height)
        return np.array([*moves, *commands, *torques])

    def _command_units(self) -> list[tuple[str, str]]:
        return [(name, "rad/s" if name == "yaw rate" else "m/s") for name in self.commands]

    def _motion(self) -> LeggedMotion:
        sensors = self.data.sensordata
        return LeggedMotion(
            self.data.qpos[None],
            self.data.qvel[None],
            self._action[None],
            self._last_action[None],
            self._command[None],
            self.data.actuator_force[None],
            sensors[self._feet].reshape(1, 4, 3),
            sensors[self._feet_velocity].reshape(1, 4, 3),
        )

    def _extras(self) -> tuple[Floats, ...]:
        derived = (self.data.sensordata.copy(), self.data.actuator_force.copy())
        return (
            self._command.copy(),
            self._action.copy(),
            self._last_action.copy(),
            self._air_time.copy(),
            *derived,
        )

    def _set_extras(self, extras: tuple[Floats, ...]) -> None:
        self._command, self._action, self._last_action, self._air_time = (one.copy() for one in extras[:4])
        self.data.sensordata[:], self.data.actuator_force[:] = extras[4], extras[5]
