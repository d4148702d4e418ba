"""A robot made from any Gymnasium environment: the base of generic robots and of those in other packages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.core.robot_links_and_state import RobotState
from pdtui.robots.environments import gymnasium_spaces
from pdtui.robots.environments.action_log import ActionLog, repeat_log
from pdtui.robots.environments.environment_builder import make_environment
from pdtui.robots.options.robot_option import NO_ROBOT_OPTIONS, RobotOptions
from pdtui.robots.robot import ResetResult, Robot, StepResult
from pdtui.robots.simulators import python_state

# Control step of an environment that does not tell its own, and the longest that is believed, s.
_DEFAULT_DT, _MAX_DT = 1.0 / 30.0, 60.0
_MAX_SEED = 2**31
# Steps that tell whether a copy of an environment continues like the original, and steps before the copy.
_TRIAL_STEPS, _STEPS_BEFORE_COPY = 24, 4


class GymnasiumRobot(Robot):
    """A Gymnasium environment as it is: its observation, its reward, its end of an episode.

    A reset without a seed draws one from the robot's own generator, so every episode is a function of a seed
    and its actions. If all of the environment's state is plain Python data, a snapshot is a copy of it. If a
    library holds state that cannot be copied (Box2D, an emulator), a snapshot consists of the seed and the
    actions since the reset, which a new environment repeats. A trial before the first reset decides which.

    A Box is passed as it is, whatever its shape. Discrete, MultiDiscrete and MultiBinary actions are integers
    counted from 0, in a vector of floats. Any other observation is flattened with `gymnasium.spaces.flatten`.

    Args:
        name: Name of the robot in maps and sessions.
        title: Name for people; by default `name`.
        environment: Registered id of the environment; by default `name`.
        options: Arguments of the environment's class.

    Raises:
        RobotError: The environment cannot be built, or its spaces cannot be used.
    """

    def __init__(
        self, name: str, title: str = "", environment: str = "", options: RobotOptions = NO_ROBOT_OPTIONS
    ) -> None:
        self.name, self.title = name, title or name
        self._environment, self._environment_options = environment or name, options
        self.env = self.make_world()
        self._flattened = not isinstance(self.env.observation_space, spaces.Box)
        observed = self.env.observation_space
        self.observation_space: Any = gymnasium_spaces.flatten_observation_space(observed, self.name)
        self.action_space = gymnasium_spaces.check_action_space(self.env.action_space, self.name)
        self.links, self.attributes = (), ()
        self.reward = 0.0
        self.info: Mapping[str, Any] = {}
        self._observation: NDArray[Any] = np.zeros(self.observation_space.shape or (0,))
        self._seed, self._start = 0, ""
        self._actions = ActionLog(0)
        self._repeats: bool | None = None

    def make_world(self) -> gymnasium.Env[Any, Any]:
        """Build a new environment; subclasses may build one that is not registered with Gymnasium."""
        return make_environment(self._environment, self._environment_options)

    @property
    def world(self) -> Any:
        """The environment itself, without its wrappers."""
        return self.env.unwrapped

    @property
    def control_dt(self) -> float:
        """The environment's ``dt``, or the time between its rendered frames, or 1/30 s."""
        dt = getattr(self.world, "dt", None)
        if isinstance(dt, float) and 0.0 < dt < _MAX_DT:
            return dt
        rate = self.world.metadata.get("render_fps")
        return 1.0 / float(rate) if isinstance(rate, int | float) and rate > 0 else _DEFAULT_DT

    def close(self) -> None:
        self.env.close()

    def observe(self) -> Floats:
        return self._observation

    def read_poses(self) -> Floats:
        return np.empty((0, 7))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> ResetResult:
        self._choose_snapshots()
        super().reset(seed=seed)
        self._seed = int(self.np_random.integers(_MAX_SEED)) if seed is None else seed
        if self._repeats:  # a used world may not repeat itself; Box2D's does not
            self.env.close()
            self.env = self.make_world()
        self._start = self.check_start(str((options or {}).get("start", ""))) if self.starts else ""
        self._actions, self.reward = ActionLog(int(np.prod(self.action_space.shape or (1,)))), 0.0
        observation, self.info = self.env.reset(seed=self._seed, options=options)
        self._see(observation)
        return self.observe(), dict(self.info)

    def step(self, action: NDArray[np.float32]) -> StepResult:
        """Step the environment.

        If the environment truncates an episode by itself, the episode ends; the time limits of registrations
        do not apply (see `make_environment`). The outcome is the environment's ``outcome`` if it says one;
        see `Robot.outcome_of`.

        Raises:
            RobotError: The action is not one of the environment's, or its outcome is not known.
            SimulationDiverged: The observation or the reward is not finite.
        """
        if self._repeats:
            self._actions.append(action)
        taken = gymnasium_spaces.vector_to_action(self.env.action_space, action, self.name)
        observation, reward, terminated, truncated, info = self.env.step(taken)
        self.reward, self.info = float(reward), info
        self._see(observation)
        self._check_finite()
        details = {**info, "cost": gymnasium_spaces.to_number(info.get("cost", 0.0)) or 0.0}
        outcome = self.outcome_of(terminated, truncated, info)
        if outcome is not None:
            details["outcome"] = outcome
        if terminated or truncated:
            details["reason"] = str(info.get("reason", "the environment ended the episode"))
        return self.observe(), self.reward, bool(terminated), bool(truncated), details

    def snapshot(self) -> RobotState:
        digest = self.digest()
        start = self.starts.index(self._start) + 1 if self._start else 0
        mark = np.array([digest, self._seed, start], np.int64).view(np.float64)
        if self._repeats:
            taken, pushes = self._actions.so_far(), self._actions.pushes_so_far()
            logged = (mark, pushes) if len(pushes) else (mark,)
            return RobotState(self.name, taken, logged, self.np_random.bit_generator.state)
        info, seen = gymnasium_spaces.numeric_entries(self.info), self._observation.copy()
        mine = {"reward": self.reward, "info": info, "seen": seen}
        memory = {"environment": python_state.copy_python_state(self.env), "robot": mine}
        state, extras = self._simulator_state()
        return RobotState(self.name, state, (mark, *extras), self.np_random.bit_generator.state, memory)

    def restore(self, snapshot: RobotState) -> None:
        self._check_snapshot(snapshot)
        self._choose_snapshots()
        digest, self._seed, start = (int(value) for value in snapshot.extras[0].view(np.int64))
        self._start = self.starts[start - 1] if start else ""
        if snapshot.memory is None:
            self.reset(seed=self._seed, options={"start": self._start} if self._start else None)
            repeat_log(self, snapshot.state.astype(np.float32), *snapshot.extras[1:])
        else:
            self._set_simulator_state(snapshot.state, snapshot.extras[1:])
            python_state.restore_python_state(self.env, snapshot.memory["environment"])
            mine = snapshot.memory["robot"]
            self.reward, self.info, self._observation = mine["reward"], mine["info"], mine["seen"].copy()
        self.np_random.bit_generator.state = snapshot.rng
        if self.digest() != digest:
            raise RobotError(
                f"{self.name}: expected the state of the snapshot, got another: the environment does not "
                "repeat itself from the same seed and actions"
            )

    def digest(self) -> int:
        if self._repeats:
            return python_state.digest_values(self._seed, len(self._actions), self._observation, self.reward)
        layers = map(python_state.plain_attributes, python_state.wrapper_layers(self.env))
        memory = [sorted(attributes.items()) for attributes in layers]
        return python_state.digest_values(memory, self._observation, self.reward)

    def _restored_apart(self) -> tuple[type, ...]:
        """Return types of attributes that have no state, or whose state `_simulator_state` returns."""
        return ()

    def _simulator_state(self) -> tuple[Floats, tuple[Floats, ...]]:
        """Return the part of a snapshot that is not Python data."""
        return np.empty(0), ()

    def _set_simulator_state(self, state: Floats, extras: tuple[Floats, ...]) -> None:
        del state, extras

    def _check_finite(self) -> None:
        if not np.isfinite(self._observation).all() or not math.isfinite(self.reward):
            raise SimulationDiverged(f"{self.name}: the simulation diverged: its output is not finite")

    def _see(self, observation: Any) -> None:
        if self._flattened:
            observation = spaces.flatten(self.env.observation_space, observation)
        # Some environments reuse the same array, so copy it.
        self._observation = np.array(observation)

    def _choose_snapshots(self) -> None:
        """Find out, once, how snapshots of this environment are made."""
        if self._repeats is None:
            self._repeats = False
            uncopyable = python_state.has_uncopyable_attributes(self.env, self._restored_apart())
            self.repeats_actions = self._repeats = uncopyable or not self._copies_restore()

    def _copies_restore(self) -> bool:
        """Return whether a restored copy continues exactly like the original, for a few random actions."""
        try:
            space = self.env.action_space
            space.seed(0)
            actions = [gymnasium_spaces.action_to_vector(space, space.sample()) for _ in range(_TRIAL_STEPS)]
            before, after = actions[:_STEPS_BEFORE_COPY], actions[_STEPS_BEFORE_COPY:]
            self.reset(seed=0)
            if self._digest_steps(before)[1]:
                self.reset(seed=0)
            snapshot, first = self.snapshot(), self._digest_steps(after)
            self.restore(snapshot)
            return self._digest_steps(after) == first
        except Exception:  # whatever an environment raises that cannot be copied
            return False

    def _digest_steps(self, actions: list[NDArray[np.float32]]) -> tuple[list[int], bool]:
        """Return a digest of each step, up to the end of the episode, and whether it ended."""
        digests = []
        for action in actions:
            _, _, terminated, truncated, _ = self.step(action)
            digests.append(python_state.digest_values(self._observation, self.reward, terminated, truncated))
            if terminated or truncated:
                return digests, True
        return digests, False
