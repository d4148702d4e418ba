"""A small world with obstacles, other ones in every episode, to be seen and counted."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.robot_links_and_state import Link, RobotState
from pdtui.core.scenery import Scenery
from pdtui.driving.control_loop import ControlLoop
from pdtui.policies.runtime.action_decoders import make_action_decoder
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.robots.robot import Robot
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

COUNT = 4
_PACE = 0.25


class Course(Robot):
    """A ball that rolls along x through posts which stand in a row, and counts those that it reaches."""

    name = "course"
    title = "Course"
    attributes: tuple[Attribute, ...] = (Attribute("vx", "m/s"), Attribute("distance", "m"))
    links = (Link("ball", 0, "sphere", (0.1,), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,), np.float64)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
    control_dt = 0.05

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.x = 0.0
        x = 1.0 + np.arange(COUNT) + self.np_random.uniform(0.0, 0.5, COUNT)
        posts = np.column_stack([x, np.zeros(COUNT), self.np_random.uniform(0.1, 0.2, COUNT)])
        self.scenery = Scenery(cylinders=posts)
        return self.observe(), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        del action
        before, self.x = self.x, self.x + _PACE
        posts = self.scenery.cylinders[:, 0]
        reached = (posts > before) & (posts <= self.x)
        return self.observe(), 1.0, False, False, {"cost": float(reached.sum())}

    def observe(self) -> Floats:
        return np.array([self.x])

    def read_attributes(self) -> Floats:
        return np.array([_PACE / self.control_dt, self.x])

    def read_poses(self) -> Floats:
        return np.array([[self.x, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0]])

    def snapshot(self) -> RobotState:
        posts = self.scenery.cylinders
        return RobotState(self.name, self.observe(), (posts,), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self.x, (posts,) = float(snapshot.state[0]), snapshot.extras
        self.scenery = Scenery(cylinders=posts)
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return int(self.x * 1000) + int(self.scenery.cylinders.sum() * 1e9)


def course_loop(seed: int = 3) -> ControlLoop:
    """A drive of it, with one behavior on the key w."""
    torch.manual_seed(1)
    network = PolicyNetwork(NetworkSpec("course", 1, (8,), "tanh", 1, "squashed_gaussian", (-1.0,), (1.0,)))
    policy = Policy(network, 1, decode=make_action_decoder(network), name="small")
    push = Behavior("push", "w", "pushes", {"0:3": 1.0})
    return ControlLoop(
        Course(), policy, StimulationMap("course", "small", "", "space", {}, {"push": push}), seed
    )
