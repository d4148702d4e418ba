"""A vehicle whose one hidden unit turns it, with a lag: a plant for controllers."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.api import load_policy
from pdtui.core.attributes import Attribute, Floats, wrap_angle
from pdtui.core.robot_links_and_state import Link, RobotState
from pdtui.driving.control_loop import ControlLoop
from pdtui.robots.robot import Robot
from pdtui.stimulation.map_reader import parse_map

LAG = 0.3
MAP = """
schema = 1
robot = "vehicle"
[policy]
name = "none"
sha256 = "none"
[[behaviors]]
name = "hold heading"  # and keep it
key = "h"
mode = "pid"
magnitudes = {{ "0:0" = 1.0 }}
pid = {{ attribute = "yaw", kp = {kp}, ki = 0.0, kd = 0.0, limit = {limit}, step = 0.1 }}  # first try
[[behaviors]]
name = "hold pace"
key = "g"
mode = "pid"
magnitudes = {{ "0:1" = 1.0 }}
pid = {{ attribute = "pace", kp = 0.2, ki = 0.0, kd = 0.0, limit = 3.0, step = 0.1 }}
[[behaviors]]
name = "turn"
key = "t"
magnitudes = {{ "0:0" = 1.0 }}
"""


class Vehicle(Robot):
    """Turns at the rate of its first action and changes its pace by the second, both 0.3 s late.

    It tips over when it turns faster than 2.5 rad/s.
    """

    name = "vehicle"
    title = "Vehicle"
    links = (Link("body", 0, "sphere", (0.1,), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),)
    attributes = (Attribute("yaw", "rad", wraps=True), Attribute("pace", "m/s"))
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)
    action_space = gymnasium.spaces.Box(-4.0, 4.0, (2,))
    state: Floats

    @property
    def control_dt(self) -> float:
        return 0.02

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.state = np.array([self.np_random.uniform(-0.1, 0.1), 0.0, 1.0, 0.0])
        return self.observe(), {}

    def observe(self) -> Floats:
        return self.state[[1, 3]]

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        yaw, rate, pace, push = self.state
        rate += self.control_dt / LAG * (float(action[0]) - rate)
        push += self.control_dt / LAG * (float(action[1]) - push)
        pace += self.control_dt * (push - (pace - 1.0))
        self.state = np.array([wrap_angle(yaw + self.control_dt * rate), rate, pace, push])
        fell = abs(rate) > 2.5
        return self.observe(), 1.0, fell, False, {"cost": 0.0} | ({"reason": "tipped over"} if fell else {})

    def read_attributes(self) -> Floats:
        return self.state[[0, 2]]

    def read_poses(self) -> Floats:
        return np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])

    def snapshot(self) -> RobotState:
        return RobotState(self.name, self.state.copy(), (), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self.state = snapshot.state.copy()

    def digest(self) -> int:
        return int.from_bytes(self.state.tobytes(), "little") % (2**63 - 1)


def turning_loop(kp: float = 0.3, limit: float = 2.0) -> ControlLoop:
    """The vehicle with two hidden units that rest at 0 and are its actions."""
    inner, outer = torch.nn.Linear(2, 2), torch.nn.Linear(2, 2)
    with torch.no_grad():
        for layer, gain in ((inner, 0.0), (outer, 1.0)):
            layer.weight.copy_(gain * torch.eye(2))
            layer.bias.zero_()
    network = torch.nn.Sequential(inner, torch.nn.Tanh(), outer)
    robot = Vehicle()
    return ControlLoop(
        robot, load_policy(network, robot), parse_map(MAP.format(kp=kp, limit=limit), "test"), 0
    )
