"""Many ANYmals that are stepped together: physics in MuJoCo's own threads, everything else in NumPy.

They are randomised as in legged_gym (Rudin et al., 2021): friction, pushes, noisy observations, commands.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import RobotState
from pdtui.robots.anymal import (
    ACTION_SCALE,
    COMMANDS,
    DEFAULT_ANGLES,
    MODEL,
    START_HEIGHT,
    SUBSTEPS,
    TARGET_HEIGHT,
    Anymal,
    foot_sensor_slices,
)
from pdtui.robots.legged import observations_and_rewards as legged
from pdtui.robots.simulators.mujoco_robot import suppress_warnings
from pdtui.training.robot_batch import RobotBatchState, TransitionBatch

_THREADS = 2
# Coordinates and velocities: a free joint (7 and 6) and 12 hinges.
_NQ, _NV = 19, 18
# Gains (N m/rad, N m s/rad) and limit (N m) of the model's motors; a batch reads no torques from MuJoCo.
_STIFFNESS, _DAMPING, _MAX_TORQUE = 80.0, 2.0, 80.0
# Lowest and highest friction of the ground, and number of values from one to the other.
_FRICTIONS = (0.5, 1.25, 8)
# Control steps between pushes, and their largest change of each horizontal velocity (m/s).
_PUSH_EVERY, _MAX_PUSH = 400, 0.8
# Control steps between new commands, and share of robots whose command is zero.
_COMMAND_EVERY, _STANDING_SHARE = 250, 0.1
# Half width of the uniform noise on height (m), velocity (m/s), angular velocity (rad/s), direction of
# gravity, joint angles (rad) and joint velocities (rad/s), each scaled as it is observed.
_VELOCITY_NOISE = (legged.LINEAR_SCALE * 0.05, legged.ANGULAR_SCALE * 0.1)
_NOISE = (0.01, *_VELOCITY_NOISE, 0.03, 0.01, legged.JOINT_SPEED_SCALE * 0.5)
# Deviations of the joints' angles (rad) and of all velocities (m/s, rad/s) at the start of an episode.
_START_ANGLE_NOISE, _START_VELOCITY_NOISE = 0.2, 0.3


class AnymalBatch:
    """A batch of ANYmals with the interface of `RobotBatch`.

    Args:
        robot: One of the robots. The commands that its policy does not see stay 0.
        count: Number of robots.
        seed: Seed of every random number.
        episode: Control steps of an episode; by default the robot's.
    """

    def __init__(self, robot: Anymal, count: int, seed: int, episode: int | None = None) -> None:
        episode = episode or robot.episode_steps
        self._name, self._episode = robot.name, episode
        self._commands = len(robot.commands)
        low, high, number = _FRICTIONS
        shared = [mujoco.MjModel.from_xml_path(str(MODEL)) for _ in range(number)]
        for model, friction in zip(shared, np.linspace(low, high, number), strict=True):
            # MuJoCo takes the larger of the two frictions of a contact.
            model.geom_friction[:, 0] = friction
        self.frictions = np.resize(np.linspace(low, high, number), count)
        self._models = [shared[index % number] for index in range(count)]
        self._data = [mujoco.MjData(shared[0]) for _ in range(_THREADS)]
        self._dt = SUBSTEPS * float(shared[0].opt.timestep)
        self._feet, self._feet_velocity = foot_sensor_slices(shared[0])
        # In the order of the observation: commands and the last action are observed without noise.
        counts = [1, 3, 3, 3, self._commands, 12, 12, 12]
        self._noise = np.repeat([*_NOISE[:4], 0.0, *_NOISE[4:], 0.0], counts)
        self._rng = np.random.default_rng(seed)
        self._physics = np.zeros((count, 1 + _NQ + _NV))
        self._command = np.zeros((count, len(COMMANDS)))
        self._action, self._last_action = np.zeros((count, 12)), np.zeros((count, 12))
        self._air_time = np.zeros((count, 4))
        self._age = np.zeros(count, np.int64)
        self.ages = [0]
        self.restarted = np.zeros(count, bool)
        self._start_over(np.ones(count, bool))
        # Spread over the episode; otherwise all robots would start over together.
        self._age[:] = self._rng.integers(0, episode, count)
        self.observations = self._observe(self._motion(np.zeros((count, 24)), np.zeros((count, 12))))

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        """Step every robot once and return the transitions, leading axis (robots,)."""
        before = self.observations
        self._last_action, self._action = self._action, actions.astype(np.float64)
        targets = DEFAULT_ANGLES + ACTION_SCALE * self._action
        control = np.repeat(targets[:, None], SUBSTEPS, axis=1)
        with suppress_warnings():  # a robot that diverges starts over
            worlds = (self._models, self._data, self._physics, control)
            states, sensors = rollout.rollout(*worlds, persistent_pool=True)
        self._physics = states[:, -1].copy()
        angles, speeds = self._physics[:, 8 : 1 + _NQ], self._physics[:, 1 + _NQ + 6 :]
        torque = np.clip(_STIFFNESS * (targets - angles) - _DAMPING * speeds, -_MAX_TORQUE, _MAX_TORQUE)
        motion = self._motion(sensors[:, -1], torque)
        reward, self._air_time = legged.compute_legged_rewards(
            motion, self._air_time, self._dt, TARGET_HEIGHT, DEFAULT_ANGLES
        )
        fell = legged.has_fallen(motion) | ~np.isfinite(self._physics).all(axis=1)
        self._age += 1
        self.restarted = fell | (self._age >= self._episode)
        following = self._observe(motion)
        self._start_over(self.restarted)
        self._disturb()
        self.observations = self._observe(self._motion(sensors[:, -1], torque))
        outcome = (reward.astype(np.float32), (~fell).astype(np.float32), np.nan_to_num(following))
        return TransitionBatch(before, actions, *outcome)

    def state(self) -> RobotBatchState:
        """Return the state of all robots as one snapshot, since they share their random numbers."""
        arrays = (
            self._command,
            self._action,
            self._last_action,
            self._air_time,
            self._age,
            self.observations,
        )
        extras = tuple(array.astype(np.float64) for array in arrays)
        rng: Any = self._rng.bit_generator.state
        return RobotBatchState([RobotState(self._name, self._physics.copy(), extras, rng)], list(self.ages))

    def restore(self, state: RobotBatchState) -> None:
        """Return to an earlier state, bit-exactly."""
        (kept,) = state.snapshots
        self._physics, *extras = (array.copy() for array in (kept.state, *kept.extras))
        self._command, self._action, self._last_action, self._air_time, age, observations = extras
        self._age, self.observations = age.astype(np.int64), observations.astype(np.float32)
        self._rng.bit_generator.state = kept.rng

    def _motion(self, sensors: Floats, torque: Floats) -> legged.LeggedRobotState:
        return legged.LeggedRobotState(
            self._physics[:, 1 : 1 + _NQ],
            self._physics[:, 1 + _NQ :],
            self._action,
            self._last_action,
            self._command,
            torque,
            sensors[:, self._feet].reshape(-1, 4, 3),
            sensors[:, self._feet_velocity].reshape(-1, 4, 3),
        )

    def _observe(self, motion: legged.LeggedRobotState) -> NDArray[np.float32]:
        clean = legged.compute_legged_observations(motion, DEFAULT_ANGLES, self._commands)
        noise = self._noise * self._rng.uniform(-1.0, 1.0, clean.shape)
        noisy: NDArray[np.float32] = (clean + noise).astype(np.float32)
        return noisy

    def _start_over(self, which: NDArray[np.bool_]) -> None:
        count = int(which.sum())
        if not count:
            return
        rng = self._rng
        fresh = np.zeros((count, 1 + _NQ + _NV))
        yaw = rng.uniform(-np.pi, np.pi, count)
        fresh[:, 3] = START_HEIGHT
        fresh[:, 4], fresh[:, 7] = np.cos(yaw / 2), np.sin(yaw / 2)
        angle_noise = rng.uniform(-_START_ANGLE_NOISE, _START_ANGLE_NOISE, (count, 12))
        fresh[:, 8 : 1 + _NQ] = DEFAULT_ANGLES + angle_noise
        fresh[:, 1 + _NQ :] = rng.uniform(-_START_VELOCITY_NOISE, _START_VELOCITY_NOISE, (count, _NV))
        self._physics[which] = fresh
        self._action[which] = self._last_action[which] = self._air_time[which] = 0.0
        self._age[which] = 0
        self._draw_commands(which)

    def _draw_commands(self, which: NDArray[np.bool_]) -> None:
        count = int(which.sum())
        drawn = np.zeros((count, len(COMMANDS)))
        for column, limits in enumerate(list(Anymal.command_ranges.values())[: self._commands]):
            drawn[:, column] = self._rng.uniform(limits.low, limits.high, count)
        drawn[self._rng.random(count) < _STANDING_SHARE] = 0.0
        self._command[which] = drawn

    def _disturb(self) -> None:
        """Give new commands and pushes to the robots whose turn it is."""
        intervals = (_COMMAND_EVERY, _PUSH_EVERY)
        again, pushed = ((self._age % interval == 0) & (self._age > 0) for interval in intervals)
        if again.any():
            self._draw_commands(again)
        if pushed.any():
            push = self._rng.uniform(-_MAX_PUSH, _MAX_PUSH, (int(pushed.sum()), 2))
            self._physics[pushed, 1 + _NQ : 3 + _NQ] += push
