"""The Ant of the paper: Gymnasium's physics, any heading at the start, a reward along either axis."""

from __future__ import annotations

import math
from typing import Any, Literal

import mujoco
import numpy as np
from gymnasium.envs.mujoco.ant_v5 import AntEnv
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome, fall_info
from pdtui.core.robot_links_and_state import Foot
from pdtui.robots.geometry import roll_pitch_yaw
from pdtui.robots.observation_edits.heading_edit import canonicalize_quaternion, quaternion_heading_edits
from pdtui.robots.observation_edits.observation_edit import offset_observed_number
from pdtui.robots.robot import RewardlessStepResult
from pdtui.robots.simulators.joint_and_trunk_attributes import TRUNK_ATTRIBUTES, torque_attributes
from pdtui.robots.simulators.mujoco_robot import (
    MujocoRobot,
    read_model_links,
    read_motor_gears,
    silence_warnings,
)
from pdtui.robots.training_recipe import TrainingRecipe

_LEGS = {"1": "front left", "2": "back left", "3": "back right", "4": "front right"}
_QUATERNION = 1  # its place in the observation


class Ant(MujocoRobot, AntEnv):
    """A four-legged torso with eight motors; a control step is 0.05 s.

    The observation (27) holds the height, the torso's quaternion, 8 joint angles, and the 14 velocities. An
    episode ends where Gymnasium's does (torso outside 0.2–1.0 m), and also when the torso lies on its back,
    which Gymnasium's Ant does not notice.

    Attributes:
        torso_heights: Range of heights of the torso outside which it has fallen, m.

    Args:
        forward: What is rewarded as moving forward: ``"either"`` is ``max(|vx|, |vy|)``, as in the paper;
            ``"x"`` is vx, as in Gymnasium's Ant. The physics is the same.
        canonical_quaternion: Observe the negative of the torso's quaternion wherever its w is negative, so
            that whole turns make no difference; otherwise the Ant observes the negative after one whole turn.
    """

    name = "ant"
    title = "Ant (MuJoCo)"
    feet = (
        Foot("front left", "left_ankle_geom", "front left"),
        Foot("front right", "fourth_ankle_geom", "front right"),
        Foot("back left", "right_ankle_geom", "rear left"),
        Foot("back right", "third_ankle_geom", "rear right"),
    )
    training_recipe = TrainingRecipe(options={"forward": "x"})

    def __init__(
        self, forward: Literal["either", "x"] = "either", canonical_quaternion: bool = False
    ) -> None:
        super().__init__(include_cfrc_ext_in_observation=False)
        self._canonical = canonical_quaternion
        self.observation_edits = (
            *quaternion_heading_edits(_QUATERNION, velocity=13, canonical=canonical_quaternion),
            offset_observed_number(0, "height offset", "m", "the torso is higher by this much"),
        )
        self._forward, self.torso_heights = forward, self._healthy_z_range
        self.links = read_model_links(self.model)
        gears = read_motor_gears(self.model)
        self._gears = np.array(list(gears.values()))
        names = [f"{_LEGS[joint[-1]]} {joint[:-2]}" for joint in gears]
        self.attributes = (*TRUNK_ATTRIBUTES, *torque_attributes(names, gears.values()))

    def observe(self) -> Floats:
        observation = np.asarray(self._get_obs())
        if self._canonical:
            canonicalize_quaternion(observation, _QUATERNION)
        return observation

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, Any, bool, bool, dict[str, Any]]:
        before = self.data.qpos[:2].copy()
        self.do_simulation(action, self.frame_skip)
        self._check_finite()
        velocity = (self.data.qpos[:2] - before) / self.dt
        forward = float(velocity[0]) if self._forward == "x" else float(np.abs(velocity).max())
        reward, info = self._get_rew(forward, action)
        reason = self._find_fall()
        info |= {"cost": 0.0, **fall_info(reason)}
        return self.observe(), float(reward), bool(reason), False, info

    def step_without_reward(self, action: NDArray[np.float32]) -> RewardlessStepResult:
        # What Gymnasium's step computes besides, forces among it, takes a third of its time.
        self.data.ctrl[:] = action
        mujoco.mj_step(self.model, self.data, self.frame_skip)
        self._check_finite()
        fell = bool(self._find_fall())
        return RewardlessStepResult(self.observe(), Outcome.FELL if fell else None, fell)

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
        # MuJoCo's angular velocity is in the body's frame; this is the third row of the rotation matrix.
        yaw_rate = 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c
        torques = (self._gears * self.data.ctrl.clip(-1.0, 1.0)).tolist()
        return np.array([vx, vy, math.hypot(vx, vy), yaw, yaw_rate, roll, pitch, height, *torques])

    def _find_fall(self) -> str:
        height = float(self.data.qpos[2])
        low, high = self.torso_heights
        if not low <= height <= high:
            return f"fell: torso at {height:.2f} m, outside {low}–{high} m"
        _, x, y, _ = self.data.qpos[3:7].tolist()
        return "fell: on its back" if 1 - 2 * (x * x + y * y) < 0 else ""
