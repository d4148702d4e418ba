"""A robot made of any Gymnasium environment: base of the generic robots, and of those in other packages."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.core.robot_data import RobotState
from pdtui.robots.environments.space_conversion import (
    action_for,
    as_vector,
    flat_observations,
    known_actions,
    number_of,
    numbers_of,
)
from pdtui.robots.robot import Robot
from pdtui.robots.simulators.actions_since_reset import ActionsSinceReset
from pdtui.robots.simulators.python_state import (
    digest_of,
    layers_of,
    plain_of,
    recall,
    remember,
    unknown_parts,
)

_USUAL_DT = 1.0 / 30.0
_SEEDS = 2**31
_ENDED = "the environment ended the episode"


def make_environment(name: str) -> gymnasium.Env[Any, Any]:
    """Build a registered environment with the wrappers of its registration, but without a time limit.

    Whoever drives decides how long: a time limit is the training's, and would end a drive without a reason
    that one sees.

    Raises:
        RobotError: a package is missing, or the environment cannot be built.
    """
    with warnings.catch_warnings():
        # Advice to trainers ("there is a newer version"), printed over the screen.
        warnings.simplefilter("ignore")
        try:
            return gymnasium.make(name, max_episode_steps=-1, disable_env_checker=True)
        except (ImportError, gymnasium.error.DependencyNotInstalled) as error:
            raise RobotError(
                f"environment '{name}' needs a package that is not installed: {error}"
            ) from error
        except Exception as error:  # whatever a third party's constructor raises
            raise RobotError(
                f"environment '{name}' cannot be built: {str(error) or type(error).__name__}"
            ) from error


class GymnasiumRobot(Robot):
    """Drives a Gymnasium environment as it is: its observation, its reward, its end of an episode.

    A reset without a seed draws one from the robot's own generator, so that every episode is a function of
    a seed and its actions. Where the environment's Python side is all there is, a snapshot is a copy of it.
    Where a library keeps state that no copy reaches (Box2D, an emulator), it is the seed and the actions
    since the reset, which a fresh environment repeats. Which of the two holds is tried before the first
    reset.

    Observations and actions: a Box is passed as it is, whatever its shape; Discrete, MultiDiscrete and
    MultiBinary actions are whole numbers counted from 0, in a vector of floats; any other observation is
    flattened with `gymnasium.spaces.flatten`.

    Args:
        name: of the robot: what maps and sessions call it.
        title: for people.

    Raises:
        RobotError: the environment cannot be built, or its spaces cannot be used.
    """

    def __init__(self, name: str, title: str = "", environment: str = "") -> None:
        self.name, self.title = name, title or name
        self._environment = environment or name
        self.env = self.make_world()
        self._flattened = not isinstance(self.env.observation_space, spaces.Box)
        self.observation_space: Any = flat_observations(self.env.observation_space, self.name)
        self.action_space = known_actions(self.env.action_space, self.name)
        self.links, self.attributes = (), ()
        self.reward = 0.0
        self.info: Mapping[str, Any] = {}
        self._observation: NDArray[Any] = np.zeros(self.observation_space.shape or (0,))
        self._seed = 0
        self._start = ""
        self._actions = ActionsSinceReset(0)
        self._repeats: bool | None = None

    def make_world(self) -> gymnasium.Env[Any, Any]:
        """A new environment; a class of its own may build another than Gymnasium has registered."""
        return make_environment(self._environment)

    @property
    def world(self) -> Any:
        """The environment itself, without its wrappers."""
        return self.env.unwrapped

    @property
    def control_dt(self) -> float:
        """The environment's ``dt``, or the time between the frames that it would render, or 1/30 s."""
        dt = getattr(self.world, "dt", None)
        if isinstance(dt, float) and 0.0 < dt < 60.0:
            return dt
        rate = self.world.metadata.get("render_fps")
        return 1.0 / float(rate) if isinstance(rate, int | float) and rate > 0 else _USUAL_DT

    def close(self) -> None:
        self.env.close()

    def observe(self) -> Floats:
        return self._observation

    def read_poses(self) -> Floats:
        return np.empty((0, 7))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        self._settle()
        super().reset(seed=seed)
        self._seed = int(self.np_random.integers(_SEEDS)) if seed is None else seed
        if self._repeats:
            self._renew()
        self._start = self.check_start(str((options or {}).get("start", ""))) if self.starts else ""
        self._actions, self.reward = ActionsSinceReset(int(np.prod(self.action_space.shape or (1,)))), 0.0
        observation, self.info = self.env.reset(seed=self._seed, options=options)
        self._see(observation)
        return self.observe(), dict(self.info)

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Advance the environment.

        An environment that truncates by itself is taken at its word, since it may not go on; the time limits
        of registrations are not applied (see `make_environment`). It has finished where its info says so by
        ``finished`` or by ``is_success``, as many environments do.

        Raises:
            RobotError: the action is not one of the environment's.
            SimulationDiverged: the observation is not finite.
        """
        if self._repeats:
            self._actions.append(action)
        observation, reward, terminated, truncated, info = self.env.step(
            action_for(self.env.action_space, action, self.name)
        )
        self.reward, self.info = float(reward), info
        self._see(observation)
        self._check_finite()
        details = {**info, "cost": number_of(info.get("cost", 0.0)) or 0.0}
        details["finished"] = bool(info.get("finished", info.get("is_success", False)))
        if terminated or truncated:
            details["reason"] = str(info.get("reason", _ENDED))
        return self.observe(), self.reward, bool(terminated), bool(truncated), details

    def snapshot(self) -> RobotState:
        digest = self.digest()
        start = self.starts.index(self._start) + 1 if self._start else 0
        mark = np.array([digest, self._seed, start], np.int64).view(np.float64)
        if self._repeats:
            return RobotState(self.name, self._actions.so_far(), (mark,), self.np_random.bit_generator.state)
        memory = {
            "environment": remember(self.env),
            "robot": {"reward": self.reward, "info": numbers_of(self.info), "seen": self._observation.copy()},
        }
        state, extras = self._simulator_state()
        return RobotState(self.name, state, (mark, *extras), self.np_random.bit_generator.state, memory)

    def restore(self, snapshot: RobotState) -> None:
        if snapshot.robot != self.name:
            raise RobotError(f"{self.name}: expected a snapshot of {self.name}, got one of {snapshot.robot}")
        self._settle()
        digest, self._seed, start = (int(value) for value in snapshot.extras[0].view(np.int64))
        self._start = self.starts[start - 1] if start else ""
        if snapshot.memory is None:
            self._repeat(snapshot.state.astype(np.float32))
        else:
            self._set_simulator_state(snapshot.state, snapshot.extras[1:])
            recall(self.env, snapshot.memory["environment"])
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
            return digest_of(self._seed, len(self._actions), self._observation, self.reward)
        memory = [sorted(plain_of(layer).items()) for layer in layers_of(self.env)]
        return digest_of(memory, self._observation, self.reward)

    def _restored_apart(self) -> tuple[type, ...]:
        """Types of attributes whose state `_simulator_state` has, or that have none."""
        return ()

    def _simulator_state(self) -> tuple[Floats, tuple[Floats, ...]]:
        """What a snapshot needs beside the Python side."""
        return np.empty(0), ()

    def _set_simulator_state(self, state: Floats, extras: tuple[Floats, ...]) -> None:
        del state, extras

    def _check_finite(self) -> None:
        if not np.isfinite(self._observation).all() or not math.isfinite(self.reward):
            raise SimulationDiverged(
                f"{self.name}: the simulation diverged: observation or reward is not finite"
            )

    def _see(self, observation: Any) -> None:
        if self._flattened:
            observation = spaces.flatten(self.env.observation_space, observation)
        # A copy: some environments fill the same array again.
        self._observation = np.array(observation)

    def _renew(self) -> None:
        """A new world: one that is used again may not repeat itself (Box2D's does not)."""
        self.env.close()
        self.env = self.make_world()

    def _repeat(self, actions: NDArray[np.float32]) -> None:
        self.reset(seed=self._seed, options={"start": self._start} if self._start else None)
        for action in actions:
            self.step(action)

    def _settle(self) -> None:
        """Find out, once, how snapshots of this environment are made."""
        if self._repeats is None:
            self._repeats = False
            handled = self._restored_apart()
            self._repeats = bool(unknown_parts(self.env, handled)) or not self._copies_restore()

    def _copies_restore(self) -> bool:
        """Whether a restored copy goes on exactly like the original, for a few random actions."""
        try:
            self.env.action_space.seed(0)
            actions = [as_vector(self.env.action_space, self.env.action_space.sample()) for _ in range(24)]
            self.reset(seed=0)
            if self._follow(actions[:4])[1]:
                self.reset(seed=0)
            snapshot, first = self.snapshot(), self._follow(actions[4:])
            self.restore(snapshot)
            return self._follow(actions[4:]) == first
        except Exception:  # whatever an environment raises that cannot be copied
            return False

    def _follow(self, actions: list[NDArray[np.float32]]) -> tuple[list[int], bool]:
        """A digest of each step, up to the end of the episode, and whether it ended."""
        digests = []
        for action in actions:
            _, _, terminated, truncated, _ = self.step(action)
            digests.append(digest_of(self._observation, self.reward, terminated, truncated))
            if terminated or truncated:
                return digests, True
        return digests, False
