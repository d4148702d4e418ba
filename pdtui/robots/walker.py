"""The Walker2d of the paper: a torso on two legs that moves in the plane of x and z."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from gymnasium.envs.mujoco.walker2d_v5 import Walker2dEnv
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, wrap_angle
from pdtui.core.outcome import Outcome, fall_info
from pdtui.core.robot_links_and_state import Foot
from pdtui.robots.observation_edits.observation_edit import offset_observed_number, set_observed_number
from pdtui.robots.robot import RewardlessStepResult
from pdtui.robots.simulators.joint_and_trunk_attributes import torque_attributes
from pdtui.robots.simulators.mujoco_robot import (
    MujocoRobot,
    read_model_links,
    read_motor_gears,
    silence_warnings,
)
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict, find_longest_run
from pdtui.robots.training_recipe import TrainingRecipe

_FEET = {"right": "foot_geom", "left": "foot_left_geom"}
# Longest time that a foot may be off the ground in training, s.
_MAX_STRIDE_TIME = 0.4
# Slowing down: share of its speed, and control steps to slow down in and to stay up for afterwards.
_SLOW_SHARE, _SLOWING_STEPS, _SLOW_STEPS = 0.25, 100, 200
# Stopping: control steps to stop in, to stand until, and after which it runs again when it is let go; speed
# that counts as standing, m/s, and share of its speed that counts as running.
_STOP_STEPS, _STAND_STEPS, _RUN_STEPS, _STANDING, _RUNS_ON = 300, 500, 750, 0.3, 0.5
# Steps at the end over which the speed is averaged.
_LAST_STEPS = 50
# Hopping: control steps to begin in and to hop for, share of these with a foot up, and slowest speed, m/s.
_HOP_FROM, _HOP_STEPS, _HOP_SHARE, _HOP_SPEED = 50, 150, 0.8, 0.3


def judge_slow_down(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it has less than a quarter of its speed from step 100 on and stays up for 200 steps."""
    usual = trace.mean_before("vx", 100)
    steps = _SLOWING_STEPS + _SLOW_STEPS
    late = trace["vx"][_SLOWING_STEPS:steps]
    left = float(np.abs(late).mean()) / usual if len(late) else 1.0
    up = trace.stays_up(steps)
    # A fall scores no more than the time before it.
    fallen_score = 0.5 * len(trace) / steps * min(1.0, max(0.0, 1.0 - left))
    score = (1.0 - left) / (1.0 - _SLOW_SHARE) if up else fallen_score
    figures = {"share of speed left": left, "steps up": len(trace)}
    return TaskVerdict(up and left < _SLOW_SHARE, score, figures)


def judge_stop_and_go(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether it stands from step 300 to 500, and runs again by step 750 after it was let go."""
    usual = max(trace.mean_before("vx", 100), 1e-6)
    late = np.abs(trace["vx"][_STOP_STEPS:_STAND_STEPS])
    left = float(late.mean()) if len(late) else usual
    again = trace.mean("vx", slice(_RUN_STEPS - _LAST_STEPS, _RUN_STEPS)) / usual
    stands = trace.stays_up(_STAND_STEPS) and left < _STANDING
    runs = trace.stays_up(_RUN_STEPS) and again >= _RUNS_ON
    stopped = min(1.0, max(0.0, (usual - left) / (usual - _STANDING)))
    score = 0.5 * stopped * min(1.0, len(trace) / _STAND_STEPS) + (0.25 if stands else 0.0)
    score += 0.25 * min(1.0, max(0.0, again / _RUNS_ON)) if runs or stands else 0.0
    figures = {"speed while it stands (m/s)": left, "steps up": len(trace), "of its own speed again": again}
    return TaskVerdict(stands and runs, score, figures)


def judge_hop(trace: TaskRunTrace) -> TaskVerdict:
    """Judge whether one foot stays off the ground for 80 % of 150 steps in a row while it moves forward.

    In a row, because each foot of a fast runner is off the ground for 80 % of the time, too.
    """
    end = _HOP_FROM + _HOP_STEPS
    window = slice(_HOP_FROM, end)
    off = [trace[f"{side} foot clearance"][window] > 0.0 for side in ("right", "left")]
    speed = trace.mean("vx", window)
    stretch = max(find_longest_run(foot) for foot in off) / _HOP_STEPS
    up = trace.stays_up(end)
    done = up and stretch >= _HOP_SHARE and speed > _HOP_SPEED
    score = stretch / _HOP_SHARE
    if not up:
        score = 0.5 * score * len(trace) / end
    elif speed <= _HOP_SPEED:
        score *= 0.6
    figures = {
        "longest stretch with one foot up (of 1)": stretch,
        "share of steps with one foot up": max(float(foot.sum()) for foot in off) / _HOP_STEPS,
        "vx (m/s)": speed,
    }
    return TaskVerdict(done, score, figures)


WALKER_TASKS = (
    Task(
        name="slow down",
        key="x",
        says="slows down to a stand and stays up",
        wanted="under 25 % of its speed after 100 steps, up for 200 more",
        walk=(200, 300),
        steps=_SLOWING_STEPS + _SLOW_STEPS,
        judge=judge_slow_down,
    ),
    Task(
        name="stop and go",
        key="x",
        says="slows down to a stand, and runs on when it is let go",
        wanted="under 0.3 m/s from step 300 to 500 and up; half its own speed again 250 steps later",
        walk=(200, 300),
        steps=_RUN_STEPS,
        judge=judge_stop_and_go,
        period=_STAND_STEPS,
    ),
    Task(
        name="hop",
        key="h",
        says="hops forward on one leg",
        wanted="one foot off the ground for 80 % of 150 steps in one stretch, moving forward",
        walk=(200, 300),
        steps=_HOP_FROM + _HOP_STEPS,
        judge=judge_hop,
    ),
)


class Walker(MujocoRobot, Walker2dEnv):
    """Gymnasium's Walker2d with the paper's foot friction, 0.9 right and 1.9 left; a control step is 0.008 s.

    The observation (17) holds the height, the pitch, 6 joint angles, and the 9 velocities, clipped at ±10.
    The reward is Gymnasium's: 1 for being up, plus vx, minus 0.001 times the squared action. An episode ends
    when the torso leaves 0.8–2.0 m or leans by more than 1 rad.

    The clearance of a foot is the height of its lowest point above the ground; below 0, the foot stands.

    Args:
        alternate: For training: whether a step costs 1 if a foot has been off the ground for more than 0.4 s.
            Without that, policies hop on one leg.
        top_speed: For training: speed beyond which going faster is not rewarded, m/s.
    """

    name = "walker"
    title = "Walker (MuJoCo)"
    feet = tuple(Foot(f"{side} foot", geom) for side, geom in _FEET.items())
    tasks = WALKER_TASKS
    state_arrays = ("_in_air",)
    observation_edits = (
        offset_observed_number(0, "height offset", "m", "the torso is higher by this much"),
        offset_observed_number(1, "pitch offset", "rad", "the torso leans forward by this much more"),
        set_observed_number(8, "vx", "m/s", "it moves forward at this speed"),
        offset_observed_number(8, "speed offset", "m/s", "it moves forward faster by this much"),
    )
    training_recipe = TrainingRecipe({"alternate": True, "top_speed": 3.4}, {"discount": 0.995})

    def __init__(self, alternate: bool = False, top_speed: float = math.inf) -> None:
        super().__init__(xml_file="walker2d.xml")
        self._alternate, self._top_speed = alternate, top_speed
        self._in_air = np.zeros(len(_FEET))
        self.links = read_model_links(self.model)
        self._feet = [self.model.geom(geom).id for geom in _FEET.values()]
        gears = read_motor_gears(self.model)
        self._gears = np.array(list(gears.values()))
        self.attributes = (
            Attribute("vx", "m/s"),
            Attribute("speed", "m/s"),
            Attribute("height", "m"),
            Attribute("pitch", "rad", wraps=True),
            Attribute("pitch rate", "rad/s"),
            *(Attribute(f"{side} foot clearance", "m") for side in _FEET),
            *torque_attributes(map(_label_joint, gears), gears.values()),
        )

    def observe(self) -> Floats:
        return np.asarray(self._get_obs())

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = super().step(action)
        self._check_finite()
        info["cost"] = 0.0
        reward -= max(0.0, float(info["x_velocity"]) - self._top_speed)
        if self._alternate:
            reward -= self._long_strides()
        if terminated:
            height, pitch = self.data.qpos[1:3].tolist()
            low, high = self._healthy_z_range
            info |= fall_info(
                f"fell: leans by {pitch:.2f} rad"
                if low < height < high
                else f"fell: torso at {height:.2f} m, outside {low}–{high} m"
            )
        return observation, float(reward), terminated, truncated, info

    def step_without_reward(self, action: NDArray[np.float32]) -> RewardlessStepResult:
        self.data.ctrl[:] = action
        mujoco.mj_step(self.model, self.data, self.frame_skip)
        self._check_finite()
        fell = not self.is_healthy
        return RewardlessStepResult(self.observe(), Outcome.FELL if fell else None, fell)

    def read_attributes(self) -> Floats:
        mujoco.mj_kinematics(self.model, self.data)
        _, height, pitch = self.data.qpos[:3].tolist()
        vx, vz, pitch_rate = self.data.qvel[:3].tolist()
        torques = (self._gears * self.data.ctrl.clip(-1.0, 1.0)).tolist()
        clearances = [self._clearance(foot) for foot in self._feet]
        return np.array(
            [vx, math.hypot(vx, vz), height, wrap_angle(pitch), pitch_rate, *clearances, *torques]
        )

    def reset_model(self) -> Floats:
        silence_warnings(self.data)
        self._in_air = np.zeros(len(_FEET))
        return np.asarray(super().reset_model())

    def _long_strides(self) -> float:
        """Return 1 if a foot has been off the ground for too long, else 0."""
        mujoco.mj_kinematics(self.model, self.data)
        for index, foot in enumerate(self._feet):
            self._in_air[index] = self._in_air[index] + self.dt if self._clearance(foot) > 0.0 else 0.0
        return float((self._in_air > _MAX_STRIDE_TIME).any())

    def _clearance(self, geom: int) -> float:
        radius, half = self.model.geom_size[geom, :2].tolist()
        # A capsule's axis is its local z, and the last number of its rotation is the cosine of the tilt.
        return float(self.data.geom_xpos[geom, 2] - abs(self.data.geom_xmat[geom, 8]) * half - radius)


def _label_joint(name: str) -> str:
    joint = name.removesuffix("_joint")
    return f"left {joint.removesuffix('_left')}" if joint.endswith("_left") else f"right {joint}"
