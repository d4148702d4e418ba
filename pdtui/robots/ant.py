"""The Ant of the paper: stock Gymnasium physics, any heading at the start, rewarded along either axis."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium.envs.mujoco.ant_v5 import AntEnv
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.robots.geometry import roll_pitch_yaw
from pdtui.robots.robot_goals import WALKING_GOALS
from pdtui.robots.simulators.mujoco_robot import GearedMotors, MujocoRobot, model_links, silence_warnings
from pdtui.robots.training_recipe import TrainingRecipe

_LEGS = {"1": "front left", "2": "back left", "3": "back right", "4": "front right"}


class Ant(MujocoRobot, AntEnv):
    """A four-legged torso with eight motors; 0.05 s a control step.

    Observation (27): height, torso quaternion, 8 joint angles; then the 14 velocities. An episode ends where
    Gymnasium's does (torso outside 0.2–1.0 m) and also when the torso lies on its back, which stock
    Ant does not notice.

    Args:
        forward: what the forward reward pays: ``"either"`` is ``max(|vx|, |vy|)``, as in the paper; ``"x"``
            is vx, as in stock Ant (facts differ on which one trains; physics is the same).
    """

    name = "ant"
    title = "Ant (MuJoCo)"
    goals = WALKING_GOALS
    training_recipe = TrainingRecipe(options={"forward": "x"})

    def __init__(self, forward: str = "either") -> None:
        super().__init__(include_cfrc_ext_in_observation=False)
        self._forward = forward
        self.links = model_links(self.model)
        self._motors = GearedMotors(self.model)
        self.attributes = (
            Attribute("vx", "m/s"),
            Attribute("vy", "m/s"),
            Attribute("speed", "m/s"),
            Attribute("yaw", "rad", wraps=True),
            Attribute("yaw rate", "rad/s"),
            Attribute("roll", "rad", wraps=True),
            Attribute("pitch", "rad"),
            Attribute("height", "m"),
            *(
                Attribute(f"{_LEGS[joint[-1]]} {joint[:-2]} torque", "N m", scale=1.0 / gear)
                for joint, gear in zip(self._motors.joints, self._motors.gears, strict=True)
            ),
        )

    @property
    def control_dt(self) -> float:
        return float(self.dt)

    def observe(self) -> Floats:
        observation: Floats = self._get_obs()
        return observation

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, Any, bool, bool, dict[str, Any]]:
        before = self.data.qpos[:2].copy()
        self.do_simulation(action, self.frame_skip)
        self._check_finite()
        velocity = (self.data.qpos[:2] - before) / self.dt
        forward = float(velocity[0]) if self._forward == "x" else float(np.abs(velocity).max())
        reward, info = self._get_rew(forward, action)
        info["cost"] = 0.0
        reason = self._fallen()
        if reason is not None:
            info["reason"] = reason
        return self.observe(), float(reward), reason is not None, False, info

    def reset_model(self) -> Floats:
        silence_warnings(self.data)
        super().reset_model()
        qpos = self.data.qpos.copy()
        yaw = self.np_random.uniform(-np.pi, np.pi)
        w, x, y, z = qpos[3:7]
        c, s = np.cos(yaw / 2), np.sin(yaw / 2)
        qpos[3:7] = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        self.set_state(qpos, self.data.qvel.copy())
        return self.observe()

    def read_attributes(self) -> Floats:
        _, _, height, w, x, y, z = self.data.qpos[:7].tolist()
        vx, vy, _, a, b, c = self.data.qvel[:6].tolist()
        roll, pitch, yaw = roll_pitch_yaw(w, x, y, z)
        # Third row of the rotation matrix: MuJoCo's angular velocity is in the body's frame.
        yaw_rate = 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c
        torques = self._motors.torques(self.data)
        return np.array([vx, vy, math.hypot(vx, vy), yaw, yaw_rate, roll, pitch, height, *torques])

    def _fallen(self) -> str | None:
        height = float(self.data.qpos[2])
        low, high = self._healthy_z_range
        if not low <= height <= high:
            return f"fell: torso at {height:.2f} m, outside {low}–{high} m"
        _, x, y, _ = self.data.qpos[3:7].tolist()
        if 1 - 2 * (x * x + y * y) < 0:
            return "fell: on its back"
        return None
