"""Any Gymnasium environment that shows no simulator: its attributes are what it observes and reports."""

from __future__ import annotations

from typing import Any

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.robots.environments.gymnasium_robot import GymnasiumRobot
from pdtui.robots.environments.gymnasium_spaces import action_to_vector, numeric_entries
from pdtui.robots.options.robot_option import NO_ROBOT_OPTIONS, RobotOptions
from pdtui.robots.robot import ResetResult

_MAX_OBSERVED = 1000


class PlainGymnasiumRobot(GymnasiumRobot):
    """An environment whose attributes are ``obs 0``, ``obs 1``, …, then ``reward``, then numbers of its info.

    An observation that is not a vector (an image), or one of more than 1000 numbers, gives no attributes,
    since nobody would steer a pixel. Units are unknown and therefore empty; scales are 1, because the policy
    observes these very numbers. Numbers of the info are those that a reset and the first step report, and NaN
    at a step that leaves them out. There are no poses and no links.
    """

    def __init__(
        self, name: str, title: str = "", environment: str = "", options: RobotOptions = NO_ROBOT_OPTIONS
    ) -> None:
        self.resets = 0
        """Number of resets so far."""
        super().__init__(name, title, environment, options)
        shape: tuple[int, ...] = self.observation_space.shape or ()
        self._observed = shape[0] if len(shape) == 1 and shape[0] <= _MAX_OBSERVED else 0
        self._reported = self._find_reported()
        names = (*(f"obs {index}" for index in range(self._observed)), "reward", *self._reported)
        self.attributes = tuple(Attribute(name, "") for name in names)

    def read_attributes(self) -> Floats:
        numbers = numeric_entries(self.info)
        reported = [numbers.get(name, float("nan")) for name in self._reported]
        observed = self._observation[: self._observed] if self._observed else ()
        return np.array([*observed, self.reward, *reported], np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> ResetResult:
        self.resets += 1
        return super().reset(seed=seed, options=options)

    @property
    def environment(self) -> str:
        """Registered id of the environment."""
        return self._environment

    @property
    def environment_options(self) -> RobotOptions:
        """Arguments of the environment's class."""
        return self._environment_options

    @property
    def offers_pictures(self) -> bool:
        """Whether the environment says that it can be drawn."""
        return "rgb_array" in (self.env.metadata.get("render_modes") or ())

    @property
    def twin_repeats_actions(self) -> bool:
        """Whether the state cannot be copied, and is told by `episode_seed` and `actions_since_reset`."""
        return bool(self._repeats)

    @property
    def episode_seed(self) -> int:
        """Seed of the present episode."""
        return self._seed

    @property
    def actions_since_reset(self) -> Floats:
        """Actions of the present episode, shape (steps, A); none for a state that can be copied."""
        return self._actions.so_far()

    def _find_reported(self) -> tuple[str, ...]:
        self.reset(seed=0)
        names = set(numeric_entries(self.info))
        self.env.action_space.seed(0)
        self.step(action_to_vector(self.env.action_space, self.env.action_space.sample()))
        return tuple(sorted((names | set(numeric_entries(self.info))) - {"reward"}))
