"""A world where one unit turns a needle once and another keeps it turning."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.attributes import Attribute, Floats
from pdtui.policies.runtime.policy import Policy
from tests.small_worlds import _Small

UNITS, TURN, SPIN = 90, 5, 6


class Compass(_Small):
    """Something that turns to where the first action points, and goes on turning by the second."""

    name = "compass"
    title = "Compass"
    attributes = (Attribute("heading", "rad"), Attribute("turning rate", "rad/s"))
    observation_space = gymnasium.spaces.Box(-9.0, 9.0, (1,), np.float64)
    action_space = gymnasium.spaces.Box(-9.0, 9.0, (2,))

    def _begin(self) -> Floats:
        return np.concatenate([self.np_random.uniform(-0.5, 0.5, 1), np.zeros(2)])

    def observe(self) -> Floats:
        return np.sin(self.state[1:2])

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        # The spin moves the origin to which a turn is relative.
        turn, spin = (float(one) for one in action)
        heading, origin, _ = self.state
        rate = 2.0 * (turn - (heading - origin)) + spin + 0.02 * self.np_random.normal()
        self.state = np.array([heading + self.control_dt * rate, origin + self.control_dt * spin, rate])
        return self.observe(), 0.0, False, False, {"cost": 0.0}

    def read_attributes(self) -> Floats:
        return self.state[[0, 2]]

    def _place(self) -> tuple[float, float]:
        return float(self.state[0]), 0.0


def compass_policy(every: float = 0.0) -> Policy:
    """Return a policy of which one unit sets where to turn to, and another how fast to spin.

    The others do next to nothing, or spin, too, if `every` says how much.
    """
    torch.manual_seed(3)
    network = nn.Sequential(nn.Linear(1, UNITS), nn.Tanh(), nn.Linear(UNITS, 2))
    head = network[2]
    assert isinstance(head, nn.Linear)
    with torch.no_grad():
        head.weight.mul_(0.002)
        head.weight[1] += every
        head.bias.zero_()
        head.weight[0, TURN] = head.weight[1, SPIN] = 0.5
    return Policy(network, 1, name="compass")
