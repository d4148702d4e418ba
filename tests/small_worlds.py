"""Two small worlds and the networks that act in them, trained here in seconds by imitating a rule.

The dot is seen as an image and moves by discrete actions; the pole shows its angle but not how fast it turns,
so that balancing it takes memory.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.robot_links_and_state import Link, RobotState
from pdtui.policies.runtime.action_decoders import decode_categorical_action
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.robot import Robot

SIDE = 6
MOVES = np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)])
HIDDEN = 24


class _Small(Robot):
    """A robot whose whole state is one short vector."""

    links = (Link("ball", 0, "sphere", (0.1,), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),)
    state: Floats

    @property
    def control_dt(self) -> float:
        return 0.05

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.state = self._begin()
        return self.observe(), {}

    def snapshot(self) -> RobotState:
        return RobotState(self.name, self.state.copy(), (), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self.state = snapshot.state.copy()
        self.np_random.bit_generator.state = snapshot.rng

    def digest(self) -> int:
        return int.from_bytes(self.state.tobytes(), "little") % (2**63 - 1)

    def read_poses(self) -> Floats:
        return np.array([[*self._place(), 0.0, 1.0, 0.0, 0.0, 0.0]])

    def _begin(self) -> Floats:
        raise NotImplementedError

    def _place(self) -> tuple[float, float]:
        raise NotImplementedError


class Dot(_Small):
    """A dot on a field of 6×6 pixels that is to go to a mark; at the mark, the mark jumps."""

    name = "dot"
    title = "Dot"
    attributes = (Attribute("x", "px"), Attribute("y", "px"), Attribute("distance", "px"))
    observation_space = gymnasium.spaces.Box(0.0, 1.0, (2, SIDE, SIDE), np.float64)
    action_space = gymnasium.spaces.Discrete(len(MOVES))  # type: ignore[assignment]

    def _begin(self) -> Floats:
        return self.np_random.integers(SIDE, size=4).astype(np.float64)

    def observe(self) -> Floats:
        return draw(self.state)

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        self.state[:2] = np.clip(self.state[:2] + MOVES[int(action[0])], 0, SIDE - 1)
        if np.array_equal(self.state[:2], self.state[2:]):
            self.state[2:] = self.np_random.integers(SIDE, size=2)
        return self.observe(), -float(self.read_attributes()[2]), False, False, {"cost": 0.0}

    def read_attributes(self) -> Floats:
        x, y = self.state[:2]
        return np.array([x, y, np.abs(self.state[:2] - self.state[2:]).sum()])

    def _place(self) -> tuple[float, float]:
        return float(self.state[0]), float(self.state[1])


class Pole(_Small):
    """An inverted pendulum that shows its angle only; it falls beyond 0.6 rad."""

    name = "pole"
    title = "Pole"
    attributes = (Attribute("angle", "rad"), Attribute("rate", "rad/s"))
    observation_space = gymnasium.spaces.Box(-2.0, 2.0, (1,), np.float64)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))

    def _begin(self) -> Floats:
        return self.np_random.uniform(-0.1, 0.1, 2)

    def observe(self) -> Floats:
        return self.state[:1] * 3.0

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        angle, rate = self.state
        acceleration = 6.0 * math.sin(angle) + 8.0 * float(np.clip(action[0], -1, 1))
        self.state = np.array([angle + self.control_dt * rate, rate + self.control_dt * acceleration])
        fell = abs(self.state[0]) > 0.6
        info = {"cost": 0.0} | ({"reason": "fell"} if fell else {})
        return self.observe(), 1.0, fell, False, info

    def read_attributes(self) -> Floats:
        return self.state.copy()

    def _place(self) -> tuple[float, float]:
        return math.sin(float(self.state[0])), 0.0


def draw(state: Floats) -> Floats:
    """Two channels: the dot and the mark."""
    image = np.zeros((2, SIDE, SIDE))
    image[0, int(state[0]), int(state[1])] = 1.0
    image[1, int(state[2]), int(state[3])] = 1.0
    return image


class ConvNet(nn.Module):
    """Wants a batch axis, as trained networks do."""

    def __init__(self) -> None:
        super().__init__()
        self.features = nn.Sequential(nn.Conv2d(2, 4, 3, padding=1), nn.ReLU(), nn.Flatten())
        self.fc, self.act = nn.Linear(4 * SIDE * SIDE, 24), nn.Tanh()
        self.logits = nn.Linear(24, len(MOVES))

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        logits: torch.Tensor = self.logits(self.act(self.fc(self.features(image))))
        return logits


class LstmNet(nn.Module):
    """One control step: observation (1,) and state to action (1,) and state."""

    def __init__(self) -> None:
        super().__init__()
        self.lstm, self.out = nn.LSTM(1, HIDDEN), nn.Linear(HIDDEN, 1)

    def forward(
        self, x: torch.Tensor, state: tuple[torch.Tensor, torch.Tensor]
    ) -> tuple[torch.Tensor, tuple[torch.Tensor, torch.Tensor]]:
        h, after = self.lstm(x.reshape(1, -1), state)
        return self.out(h).reshape(-1), after


def initial_state() -> tuple[torch.Tensor, torch.Tensor]:
    return torch.zeros(1, HIDDEN), torch.zeros(1, HIDDEN)


@cache
def trained_conv() -> ConvNet:
    """Goes to the mark: along x first, then along y."""
    torch.set_num_threads(1)
    torch.manual_seed(0)
    states = np.stack(np.unravel_index(np.arange(SIDE**4), (SIDE,) * 4), axis=1)
    ahead = states[:, 2:] - states[:, :2]
    along_x = np.where(ahead[:, 0] < 0, 1, 2)
    along_y = np.where(ahead[:, 1] < 0, 3, np.where(ahead[:, 1] > 0, 4, 0))
    wanted = torch.from_numpy(np.where(ahead[:, 0] != 0, along_x, along_y))
    images = torch.from_numpy(np.array([draw(state) for state in states], np.float32))
    network = ConvNet()
    optimizer = torch.optim.Adam(network.parameters(), 1e-2)
    for epoch in range(24):
        for rows in torch.randperm(len(states), generator=torch.Generator().manual_seed(epoch)).split(64):
            loss = nn.functional.cross_entropy(network(images[rows]), wanted[rows])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    return network


@cache
def trained_lstm() -> LstmNet:
    """Balances as a rule does that sees the rate."""
    torch.set_num_threads(1)
    torch.manual_seed(0)
    rng, robot = np.random.default_rng(0), Pole()
    seen, wanted = np.zeros((40, 96, 1), np.float32), np.zeros((40, 96, 1), np.float32)
    for row in range(96):
        robot.reset(seed=row)
        robot.state = rng.uniform(-0.25, 0.25, 2)
        for step in range(40):
            seen[step, row] = robot.observe()
            angle, rate = robot.state
            wanted[step, row] = np.clip(-3.0 * angle - 0.7 * rate, -1, 1)
            noise = 0.3 * rng.standard_normal() if row % 2 else 0.0
            robot.step(wanted[step, row] + np.float32(noise))
    network = LstmNet()
    optimizer = torch.optim.Adam(network.parameters(), 2e-2)
    inputs, targets = torch.from_numpy(seen), torch.from_numpy(wanted)
    for _ in range(150):
        loss = nn.functional.mse_loss(network.out(network.lstm(inputs)[0]), targets)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return network


def dot_policy() -> Policy:
    return Policy(trained_conv(), (2, SIDE, SIDE), decode=decode_categorical_action, batched=True, name="dot")


def pole_policy() -> Policy:
    return Policy(trained_lstm(), 1, initial_state=initial_state(), name="pole")
