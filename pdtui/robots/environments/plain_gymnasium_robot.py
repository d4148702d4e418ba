"""Any Gymnasium environment that shows no simulator: its attributes are what it observes and reports."""

from __future__ import annotations

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.robots.environments.gymnasium_robot import GymnasiumRobot
from pdtui.robots.environments.space_conversion import as_vector, numbers_of

_MOST_OBSERVED = 1000


class PlainGymnasiumRobot(GymnasiumRobot):
    """An environment whose attributes are ``obs 0``, ``obs 1``, …, then ``reward``, then numbers of its info.

    An observation that is no vector (an image), or one of more than 1000 numbers, gives no attributes: its
    pixels are no quantities that one would steer. Units are not known, so they are empty; scales are 1, as
    the policy observes these very numbers. Numbers of the info are those that a reset and the first step
    report; where a later step leaves one out it is NaN. There are no poses and no links.
    """

    def __init__(self, name: str, title: str = "", environment: str = "") -> None:
        super().__init__(name, title, environment)
        shape: tuple[int, ...] = self.observation_space.shape or ()
        observed = shape[0] if len(shape) == 1 and shape[0] <= _MOST_OBSERVED else 0
        self._observed = observed
        self._reported = self._find_reported()
        names = (*(f"obs {index}" for index in range(observed)), "reward", *self._reported)
        self.attributes = tuple(Attribute(name, "") for name in names)

    def read_attributes(self) -> Floats:
        numbers = numbers_of(self.info)
        reported = [numbers.get(name, float("nan")) for name in self._reported]
        observed = self._observation[: self._observed] if self._observed else ()
        return np.array([*observed, self.reward, *reported], np.float64)

    def _find_reported(self) -> tuple[str, ...]:
        self.reset(seed=0)
        names = set(numbers_of(self.info))
        self.env.action_space.seed(0)
        self.step(as_vector(self.env.action_space, self.env.action_space.sample()))
        names |= set(numbers_of(self.info))
        return tuple(sorted(names - {"reward"}))
