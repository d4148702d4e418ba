"""A small road on which a car arrives, crashes, leaves the road or runs out of time, as its keys have it."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.api import load_policy
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.outcome import Outcome
from pdtui.core.robot_links_and_state import Link, RobotState
from pdtui.driving.control_loop import ControlLoop
from pdtui.robots.robot import Robot
from pdtui.stimulation.map_reader import parse_map

LENGTH, TIME = 10.0, 60
MAP = """
schema = 1
robot = "road"
[policy]
name = "none"
sha256 = "none"
[[behaviors]]
name = "left"
key = "a"
magnitudes = { "0:0" = 1.0 }
aim = { attribute = "y", direction = "increase" }
[[behaviors]]
name = "right"
key = "d"
magnitudes = { "0:0" = -1.0 }
aim = { attribute = "y", direction = "decrease" }
[[behaviors]]
name = "brake"
key = "b"
magnitudes = { "0:1" = -1.0 }
aim = { attribute = "speed", direction = "decrease" }
"""


class Road(Robot):
    """A car that drives along x at 5 m/s: 10 m, 40 steps, take it to its destination.

    Its actions are the speed sideways, m/s, and the change of its speed, in tenths of 5 m/s. A wall is on the
    right at y = −1 m from x = 2 m on; the road ends on the left at y = 1 m. Each step in which the car brakes
    costs 0.5.
    """

    name = title = "road"
    links = (Link("body", 0, "sphere", (0.1,), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),)
    attributes = (Attribute("x", "m"), Attribute("y", "m"), Attribute("speed", "m/s"))
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)
    action_space = gymnasium.spaces.Box(-10.0, 10.0, (2,))
    outcomes = (Outcome.ARRIVED, Outcome.CRASHED, Outcome.LEFT_ROAD)
    control_dt = 0.05
    state: Floats

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.state = np.array([0.0, self.np_random.uniform(-0.05, 0.05), 5.0, 0.0])
        return self.observe(), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        x, y, speed, steps = self.state
        speed = float(np.clip(speed + 0.5 * action[1], 0.0, 5.0))
        x, y, steps = x + self.control_dt * speed, y + self.control_dt * float(action[0]), steps + 1
        self.state = np.array([x, y, speed, steps])
        info: dict[str, Any] = {"cost": 0.5 if action[1] < 0.0 else 0.0}
        if y >= 1.0:
            info |= {"outcome": "left the road", "reason": "off the asphalt"}
        elif y <= -1.0 and x >= 2.0:
            info |= {"outcome": "crashed", "reason": "hit the wall"}
        elif x >= LENGTH:
            info |= {"outcome": "arrived", "reason": "arrived at the destination"}
        elif steps >= TIME:
            info |= {"outcome": "out of time", "reason": "the time is up"}
        over = info.get("outcome", "")
        return self.observe(), speed, bool(over) and over != "out of time", over == "out of time", info

    def observe(self) -> Floats:
        return self.state[:2].copy()

    def read_attributes(self) -> Floats:
        return self.state[:3].copy()

    def read_poses(self) -> Floats:
        return np.array([[*self.state[:2], 0.0, 1.0, 0.0, 0.0, 0.0]])

    def snapshot(self) -> RobotState:
        return RobotState(self.name, self.state.copy(), (), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self.state = snapshot.state.copy()
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return int.from_bytes(self.state.tobytes(), "little") % (2**63 - 1)


def road_loop(seed: int = 0) -> ControlLoop:
    """The car with two hidden units that rest at 0 and are its actions."""
    inner, outer = torch.nn.Linear(2, 2), torch.nn.Linear(2, 2)
    with torch.no_grad():
        for layer, gain in ((inner, 0.0), (outer, 1.0)):
            layer.weight.copy_(gain * torch.eye(2))
            layer.bias.zero_()
    network, robot = torch.nn.Sequential(inner, torch.nn.Tanh(), outer), Road()
    return ControlLoop(robot, load_policy(network, robot), parse_map(MAP, "test"), seed)
