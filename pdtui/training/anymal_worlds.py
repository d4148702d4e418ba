"""Many copies of a legged robot at once: physics in MuJoCo's own threads, everything else in NumPy.

Randomised as in legged_gym (Rudin et al. 2021): friction, pushes, noise on what is observed, commands.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_data import RobotState
from pdtui.robots.anymal import ACTION_SCALE, COMMANDS, DEFAULT, HEIGHT, MODEL, SUBSTEPS, Anymal, feet_of
from pdtui.robots.legged.legged_rewards import (
    LeggedMotion,
    RewardWeights,
    fallen,
    legged_observations,
    legged_rewards,
)
from pdtui.robots.simulators.mujoco_robot import ignored_warnings
from pdtui.training.sac import TransitionBatch
from pdtui.training.world_batch import WorldBatchState

_THREADS = 2
_NQ, _NV = 19, 18


@dataclass(frozen=True)
class DomainRandomisation:
    """What differs between worlds, and from step to step.

    Attributes:
        frictions: lowest and highest of the ground's, and how many between.
        push_every: control steps between pushes.
        push: largest change of the horizontal velocity, m/s.
        command_every: control steps between new commands.
        standing: share of worlds whose command is zero.
        noise: standard deviation of what is observed, for each kind: height, velocity, angular velocity,
            gravity, joint positions, joint velocities, before scaling.
    """

    frictions: tuple[float, float, int] = (0.5, 1.25, 8)
    push_every: int = 400
    push: float = 0.8
    command_every: int = 250
    standing: float = 0.1
    noise: tuple[float, ...] = (0.01, 0.05, 0.1, 0.03, 0.01, 0.5)


class AnymalWorldBatch:
    """A batch of ANYmals that start over by themselves; offers what `worlds.Worlds` does.

    Args:
        robot: one of them; of `COMMANDS`, its policy sees as many as it has, and the others stay 0.
        count: worlds.
        seed: of everything random.
        episode: control steps after which a world starts over; the robot's unless given.
    """

    def __init__(self, robot: Anymal, count: int, seed: int, episode: int | None = None) -> None:
        episode = episode or robot.episode_steps
        self._name, self._count, self._episode = robot.name, count, episode
        self._commands = len(robot.commands)
        self._random, self._weights = DomainRandomisation(), RewardWeights()
        low, high, number = self._random.frictions
        shared = [mujoco.MjModel.from_xml_path(str(MODEL)) for _ in range(number)]
        for model, friction in zip(shared, np.linspace(low, high, number), strict=True):
            # MuJoCo takes the larger of the two frictions of a contact.
            model.geom_friction[:, 0] = friction
        self.frictions = np.resize(np.linspace(low, high, number), count)
        self._models = [shared[index % number] for index in range(count)]
        self._data = [mujoco.MjData(shared[0]) for _ in range(_THREADS)]
        self._dt = SUBSTEPS * float(shared[0].opt.timestep)
        self._feet, self._feet_velocity = feet_of(shared[0])
        self._rng = np.random.default_rng(seed)
        self._physics = np.zeros((count, 1 + _NQ + _NV))
        self._command = np.zeros((count, len(COMMANDS)))
        self._action, self._last_action = np.zeros((count, 12)), np.zeros((count, 12))
        self._air_time = np.zeros((count, 4))
        self._age = np.zeros(count, np.int64)
        self.ages = [0]
        self.restarted = np.zeros(count, bool)
        self._start_over(np.ones(count, bool))
        # Spread over the episode, or all worlds would start over together.
        self._age[:] = self._rng.integers(0, episode, count)
        self.observations = self._observe(self._motion(np.zeros((count, 24)), np.zeros((count, 12))))

    def step(self, actions: NDArray[np.float32]) -> TransitionBatch:
        """Step every robot once and return the transitions, leading axis (worlds,)."""
        before = self.observations
        self._last_action, self._action = self._action, actions.astype(np.float64)
        targets = DEFAULT + ACTION_SCALE * self._action
        control = np.repeat(targets[:, None], SUBSTEPS, axis=1)
        with ignored_warnings():  # a world that diverges starts over
            states, sensors = rollout.rollout(
                self._models, self._data, self._physics, control, persistent_pool=True
            )
        self._physics = states[:, -1].copy()
        joints = self._physics[:, 8 : 1 + _NQ], self._physics[:, 1 + _NQ + 6 :]
        torque = np.clip(80.0 * (targets - joints[0]) - 2.0 * joints[1], -80.0, 80.0)
        motion = self._motion(sensors[:, -1], torque)
        paid, self._air_time = legged_rewards(
            motion, self._air_time, self._dt, HEIGHT, DEFAULT, self._weights
        )
        fell = fallen(motion) | ~np.isfinite(self._physics).all(axis=1)
        self._age += 1
        self.restarted = fell | (self._age >= self._episode)
        following = self._observe(motion)
        self._start_over(self.restarted)
        self._disturb()
        self.observations = self._observe(self._motion(sensors[:, -1], torque))
        return TransitionBatch(
            before, actions, paid.astype(np.float32), (~fell).astype(np.float32), np.nan_to_num(following)
        )

    def state(self) -> WorldBatchState:
        """All worlds as one snapshot: they share their random numbers."""
        extras = (
            self._command,
            self._action,
            self._last_action,
            self._air_time,
            self._age.astype(np.float64),
            self.observations.astype(np.float64),
        )
        rng: Any = self._rng.bit_generator.state
        kept = RobotState(self._name, self._physics.copy(), tuple(one.copy() for one in extras), rng)
        return WorldBatchState([kept], list(self.ages))

    def restore(self, state: WorldBatchState) -> None:
        (kept,) = state.snapshots
        self._physics = kept.state.copy()
        self._command, self._action, self._last_action, self._air_time = (
            one.copy() for one in kept.extras[:4]
        )
        self._age, self.observations = kept.extras[4].astype(np.int64), kept.extras[5].astype(np.float32)
        self._rng.bit_generator.state = kept.rng

    def _motion(self, sensors: Floats, torque: Floats) -> LeggedMotion:
        return LeggedMotion(
            self._physics[:, 1 : 1 + _NQ],
            self._physics[:, 1 + _NQ :],
            self._action,
            self._last_action,
            self._command,
            torque,
            sensors[:, self._feet].reshape(-1, 4, 3),
            sensors[:, self._feet_velocity].reshape(-1, 4, 3),
        )

    def _observe(self, motion: LeggedMotion) -> NDArray[np.float32]:
        clean = legged_observations(motion, DEFAULT, self._commands)
        height, velocity, turning, gravity, joints, speeds = self._random.noise
        spread = np.concatenate(
            [
                [height],
                np.full(3, 2.0 * velocity),
                np.full(3, 0.25 * turning),
                np.full(3, gravity),
                np.zeros(self._commands),
                np.full(12, joints),
                np.full(12, 0.05 * speeds),
                np.zeros(12),
            ]
        )
        noisy: NDArray[np.float32] = (clean + spread * self._rng.uniform(-1.0, 1.0, clean.shape)).astype(
            np.float32
        )
        return noisy

    def _start_over(self, which: NDArray[np.bool_]) -> None:
        count = int(which.sum())
        if not count:
            return
        rng = self._rng
        fresh = np.zeros((count, 1 + _NQ + _NV))
        yaw = rng.uniform(-np.pi, np.pi, count)
        fresh[:, 3] = 0.55
        fresh[:, 4], fresh[:, 7] = np.cos(yaw / 2), np.sin(yaw / 2)
        fresh[:, 8 : 1 + _NQ] = DEFAULT + rng.uniform(-0.2, 0.2, (count, 12))
        fresh[:, 1 + _NQ :] = rng.uniform(-0.3, 0.3, (count, _NV))
        self._physics[which] = fresh
        self._action[which] = self._last_action[which] = 0.0
        self._air_time[which] = 0.0
        self._age[which] = 0
        self._ask(which)

    def _ask(self, which: NDArray[np.bool_]) -> None:
        """New commands."""
        count, random = int(which.sum()), self._random
        ranges = [(one.low, one.high) for one in Anymal.command_ranges.values()]
        asked = np.zeros((count, len(COMMANDS)))
        for column in range(self._commands):
            asked[:, column] = self._rng.uniform(*ranges[column], count)
        asked[self._rng.random(count) < random.standing] = 0.0
        self._command[which] = asked

    def _disturb(self) -> None:
        age = self._age
        again = (age % self._random.command_every == 0) & (age > 0)
        if again.any():
            self._ask(again)
        pushed = (age % self._random.push_every == 0) & (age > 0)
        if pushed.any():
            push = self._rng.uniform(-self._random.push, self._random.push, (int(pushed.sum()), 2))
            self._physics[pushed, 1 + _NQ : 3 + _NQ] += push
