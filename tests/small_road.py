"""A small road with traffic that comes and goes, to be driven on, drawn and recorded."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.robot_links_and_state import Link, RobotState
from pdtui.core.scenery import BoxKind, LineKind, RoadLine, Scenery, Traffic
from pdtui.driving.control_loop import ControlLoop
from pdtui.policies.runtime.action_decoders import make_action_decoder
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.robots.robot import Robot
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

LANE, LENGTH = 3.5, 300.0
SPEED, TRUCK_SPEED = 1.0, 0.5
"""Meters per control step."""
APPEARS, VANISHES = 4, 10
"""Control steps at whose end the truck is there for the first time, and no longer there."""
CAR = Link("body", 0, "box", (2.3, 0.9, 0.7), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


class SmallRoad(Robot):
    """A car that drives straight on along the first of two lanes, on a road that leads to the north.

    Each episode has a car that stands still on the other lane, cones elsewhere, a parked barrier, and a truck
    that drives ahead for a few steps. Roads of odd and of even episodes have different lengths.
    """

    name = "small-road"
    title = "Small road"
    attributes: tuple[Attribute, ...] = (Attribute("speed", "m/s"), Attribute("distance", "m"))
    links = (CAR,)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,), np.float64)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
    control_dt = 0.1

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.steps = 0
        self._build_world(LENGTH + float(self.np_random.integers(100)))
        return self.observe(), {}

    def _build_world(self, length: float) -> None:
        self.length = length
        y = np.arange(0.0, length, 2.0)
        places: dict[LineKind, float] = {
            "road edge": -LANE / 2,
            "broken lane line": LANE / 2,
            "solid lane line": 1.5 * LANE,
            "route": 0.0,
        }
        lines = (RoadLine(kind, np.column_stack([np.full(len(y), x), y])) for kind, x in places.items())
        cones = np.array([[-LANE / 2, 12.0 + 2.0 * row, 0.3] for row in range(3)])
        self.scenery = Scenery(tuple(lines), cones)

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        del action
        self.steps += 1
        return self.observe(), 1.0, False, False, {"cost": 0.0}

    def read_traffic(self) -> Traffic:
        y = self.steps * SPEED
        kinds: tuple[BoxKind, ...] = ("vehicle", "obstacle")
        poses = [[LANE, 25.0, 0.8, np.pi / 2], [LANE, 40.0, 0.5, 0.0]]
        sizes = [[4.6, 1.8, 1.6], [2.0, 0.4, 1.0]]
        if APPEARS <= self.steps < VANISHES:
            kinds = (*kinds, "vehicle")
            poses.append([0.0, 15.0 + TRUCK_SPEED * self.steps, 1.5, np.pi / 2])
            sizes.append([8.0, 2.5, 3.0])
        return Traffic(
            np.arange(len(kinds)), kinds, np.array(poses), np.array(sizes), np.array([[LANE, y + 9.0]])
        )

    def observe(self) -> Floats:
        return np.array([float(self.steps)])

    def read_attributes(self) -> Floats:
        return np.array([SPEED / self.control_dt, self.steps * SPEED])

    def read_poses(self) -> Floats:
        half = np.sqrt(0.5)
        return np.array([[0.0, self.steps * SPEED, 0.7, half, 0.0, 0.0, half]])

    def snapshot(self) -> RobotState:
        state = np.array([self.steps, self.length])
        return RobotState(self.name, state, (), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self.steps = int(snapshot.state[0])
        if snapshot.state[1] != self.length:
            self._build_world(float(snapshot.state[1]))
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return self.steps + 10_000 * int(self.length)


def small_road_loop(seed: int = 3) -> ControlLoop:
    """A drive of it, with one behavior on the key w."""
    torch.manual_seed(1)
    spec = NetworkSpec("small-road", 1, (8,), "tanh", 1, "squashed_gaussian", (-1.0,), (1.0,))
    network = PolicyNetwork(spec)
    policy = Policy(network, 1, decode=make_action_decoder(network), name="small")
    push = Behavior("push", "w", "pushes", {"0:3": 1.0})
    behaviors = StimulationMap("small-road", "small", "", "space", {}, {"push": push})
    return ControlLoop(SmallRoad(), policy, behaviors, seed)
