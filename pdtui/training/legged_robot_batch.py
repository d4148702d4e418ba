"""Many legged robots that are stepped together: physics in MuJoCo's own threads, everything else in NumPy.

They are randomized as in legged_gym (Rudin et al., 2021): friction, pushes, noisy observations, commands.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import RobotState
from pdtui.robots.legged import observations_and_rewards as legged
from pdtui.robots.legged.legged_robot import LeggedRobot
from pdtui.robots.legged.legged_robot_state import LeggedRobotState, LeggedStateReader, compute_yaws
from pdtui.robots.simulators.mujoco_robot import suppress_warnings
from pdtui.training.robot_batch import RobotBatchState, TransitionBatch
from pdtui.training.terrain_curriculum import TerrainCurriculum

_THREADS = 2
# Control steps between pushes, and their largest change of each horizontal velocity (m/s).
_PUSH_EVERY, _MAX_PUSH = 400, 0.8
# Control steps between new commands, and share of robots that are commanded to stand.
_COMMAND_EVERY, _STANDING_SHARE = 250, 0.1
# Half width of the uniform noise on height (m), velocity (m/s), angular velocity (rad/s), direction of
# gravity, joint angles (rad), joint velocities (rad/s) and scanned heights (m), each scaled as observed.
_VELOCITY_NOISE = (legged.LINEAR_SCALE * 0.05, legged.ANGULAR_SCALE * 0.1)
_NOISE = (0.01, *_VELOCITY_NOISE, 0.03, 0.01, legged.JOINT_SPEED_SCALE * 0.5)
_SCAN_NOISE = 0.02
# Deviations of the joints' angles (rad) and of all velocities (m/s, rad/s) at the start of an episode.
_START_ANGLE_NOISE, _START_VELOCITY_NOISE = 0.2, 0.3


class LeggedRobotBatch:
    """A batch of robots of one description, with the interface of `RobotBatch`.

    A robot that starts on rough ground starts on ground that becomes rougher the longer it stays on its feet;
    see `TerrainCurriculum`.

    Args:
        robot: One of the robots. Commands that cannot be given, or have no range, stay 0.
        count: Number of robots.
        seed: Seed of every random number.
        episode: Control steps of an episode; by default the robot's.
    """

    def __init__(self, robot: LeggedRobot, count: int, seed: int, episode: int | None = None) -> None:
        episode = episode or robot.episode_steps
        self._name, self._episode, self._one = robot.name, episode, robot.description
        self._ranges = {
            index: robot.command_ranges[name]
            for index, name in enumerate(robot.command_names)
            if name in robot.commands and name in robot.command_ranges
        }
        self._grounds = TerrainCurriculum(robot, count)
        self.frictions = self._grounds.frictions
        model = self._grounds.models[0]
        self._reader = LeggedStateReader(model, self._one)
        self._data = [mujoco.MjData(model) for _ in range(_THREADS)]
        self._dt = self._one.substeps * float(model.opt.timestep)
        self._nq, self._nv, joints = model.nq, model.nv, model.nu
        # A batch reads no torques from MuJoCo.
        self._gains = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
        self._limits = model.actuator_forcerange[:, 1].copy()
        # In the order of the observation: commands and the last action are observed without noise.
        counts, noise = (
            [1, 3, 3, 3, self._one.observed_commands, joints, joints, joints],
            [*_NOISE[:4], 0.0, *_NOISE[4:], 0.0],
        )
        if (scan := self._one.scan) is not None:
            counts, noise = [*counts, len(scan.points)], [*noise, _SCAN_NOISE * scan.scale]
        self._noise = np.repeat(noise, counts)
        self._rng = np.random.default_rng(seed)
        self._physics = np.zeros((count, 1 + self._nq + self._nv))
        self._command = np.zeros((count, 3))
        self._action, self._last_action = np.zeros((count, joints)), np.zeros((count, joints))
        self._foot_times = np.zeros((count, 2, len(self._one.feet)))
        self._age = np.zeros(count, np.int64)
        self.ages = [0]
        self.restarted = np.zeros(count, bool)
        self._start_over(np.ones(count, bool))
        # Spread over the episode; otherwise all robots would start over together.
        self._age[:] = self._rng.integers(0, episode, count)
        self.observations = self._observe(
            self._motion(np.zeros((count, model.nsensordata)), np.zeros((count, joints)))
        )

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        """Step every robot once and return the transitions, leading axis (robots,)."""
        before, one = self.observations, self._one
        self._last_action, self._action = self._action, actions.astype(np.float64)
        targets = one.stance + one.action_scale * self._action
        control = np.repeat(targets[:, None], one.substeps, axis=1)
        with suppress_warnings():  # a robot that diverges starts over
            worlds = (self._grounds.models, self._data, self._physics, control)
            states, sensors = rollout.rollout(*worlds, persistent_pool=True)
        self._physics = states[:, -1].copy()
        angles, speeds = self._physics[:, 8 : 1 + self._nq], self._physics[:, 1 + self._nq + 6 :]
        stiffness, damping = self._gains
        torque = np.clip(stiffness * (targets - angles) - damping * speeds, -self._limits, self._limits)
        motion = self._motion(sensors[:, -1], torque)
        fell = legged.has_fallen(motion, one.fall) | ~np.isfinite(self._physics).all(axis=1)
        reward, self._foot_times = legged.compute_legged_rewards(
            motion, self._foot_times, self._dt, one, fell
        )
        self._age += 1
        self.restarted = fell | (self._age >= self._episode)
        following = self._observe(motion)
        self._grounds.update_levels(self.restarted, fell, self._rng)
        self._start_over(self.restarted)
        self.observations = following.copy()
        changed = self.restarted | self._disturb()
        if changed.any():  # scanning the ground for all of them again would take as long as the rest
            self.observations[changed] = self._observe(self._motion(sensors[:, -1], torque, changed))
        outcome = (reward.astype(np.float32), (~fell).astype(np.float32), np.nan_to_num(following))
        return TransitionBatch(before, actions, *outcome)

    def state(self) -> RobotBatchState:
        """Return the state of all robots as one snapshot, since they share their random numbers."""
        arrays = (
            self._command,
            self._action,
            self._last_action,
            self._foot_times,
            self._age,
            self.observations,
            self._grounds.levels,
        )
        extras = tuple(array.astype(np.float64) for array in arrays)
        rng: Any = self._rng.bit_generator.state
        return RobotBatchState([RobotState(self._name, self._physics.copy(), extras, rng)], list(self.ages))

    def restore(self, state: RobotBatchState) -> None:
        """Return to an earlier state, bit-exactly."""
        (kept,) = state.snapshots
        self._physics, *extras = (array.copy() for array in (kept.state, *kept.extras))
        self._command, self._action, self._last_action, self._foot_times, age, observations, levels = extras
        self._age, self.observations = age.astype(np.int64), observations.astype(np.float32)
        self._grounds.set_levels(levels.astype(np.intp))
        self._rng.bit_generator.state = kept.rng

    def _motion(
        self, sensors: Floats, torque: Floats, which: NDArray[np.bool_] | slice = slice(None)
    ) -> LeggedRobotState:
        physics = self._physics[which]
        return self._reader.read(
            physics[:, 1 : 1 + self._nq],
            physics[:, 1 + self._nq :],
            (self._action[which], self._last_action[which]),
            self._command[which],
            torque[which],
            sensors[which],
            self._grounds.heights_under(which),
        )

    def _observe(self, motion: LeggedRobotState) -> NDArray[np.float32]:
        clean = legged.compute_legged_observations(motion, self._one)
        noise = self._noise * self._rng.uniform(-1.0, 1.0, clean.shape)
        noisy: NDArray[np.float32] = (clean + noise).astype(np.float32)
        return noisy

    def _start_over(self, which: NDArray[np.bool_]) -> None:
        count = int(which.sum())
        if not count:
            return
        rng, joints = self._rng, self._action.shape[1]
        fresh = np.zeros((count, 1 + self._nq + self._nv))
        yaw = rng.uniform(-np.pi, np.pi, count)
        fresh[:, 1:3], fresh[:, 3] = self._grounds.sample_start_places(which, rng)
        fresh[:, 3] += self._one.start_height
        fresh[:, 4], fresh[:, 7] = np.cos(yaw / 2), np.sin(yaw / 2)
        angle_noise = rng.uniform(-_START_ANGLE_NOISE, _START_ANGLE_NOISE, (count, joints))
        fresh[:, 8 : 1 + self._nq] = self._one.stance + angle_noise
        fresh[:, 1 + self._nq :] = rng.uniform(
            -_START_VELOCITY_NOISE, _START_VELOCITY_NOISE, (count, self._nv)
        )
        self._physics[which] = fresh
        self._action[which] = self._last_action[which] = self._foot_times[which] = 0.0
        self._age[which] = 0
        self._draw_commands(which)

    def _draw_commands(self, which: NDArray[np.bool_]) -> None:
        count = int(which.sum())
        drawn = np.zeros((count, 3))
        for column, limits in self._ranges.items():
            drawn[:, column] = self._rng.uniform(limits.low, limits.high, count)
        drawn[self._rng.random(count) < _STANDING_SHARE] = 0.0
        if self._one.heading_gain:
            drawn[:, 2] += compute_yaws(self._physics[which, 1 : 1 + self._nq])
        self._command[which] = drawn

    def _disturb(self) -> NDArray[np.bool_]:
        """Give new commands and pushes to the robots whose turn it is, and return which ones that were."""
        intervals = (_COMMAND_EVERY, _PUSH_EVERY)
        again, pushed = ((self._age % interval == 0) & (self._age > 0) for interval in intervals)
        if again.any():
            self._draw_commands(again)
        if pushed.any():
            push = self._rng.uniform(-_MAX_PUSH, _MAX_PUSH, (int(pushed.sum()), 2))
            self._physics[pushed, 1 + self._nq : 3 + self._nq] += push
        disturbed: NDArray[np.bool_] = again | pushed
        return disturbed
