"""Environments without a simulator that shows itself: observed attributes, copies or repeated actions."""

from __future__ import annotations

import struct
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.robots import make_robot
from pdtui.robots.environments.plain_gymnasium_robot import PlainGymnasiumRobot
from tests.robots.wrapped_environments import follow, random_actions, values_of

COPIED = ("Pendulum-v1", "CartPole-v1", "Acrobot-v1", "MountainCar-v0", "FrozenLake-v1", "Blackjack-v1")
REPEATED = ("BipedalWalker-v3", "LunarLander-v3")


@pytest.mark.parametrize("name", [*COPIED, *REPEATED])
def test_a_snapshot_restores_bit_exactly_into_this_and_another_robot(name: str) -> None:
    """Resets that follow included: each starts from a seed that the robot's own generator gives."""
    robot, actions = make_robot(name), random_actions(name, 120)
    robot.reset(seed=3)
    follow(robot, actions[:30])
    snapshot = robot.snapshot()
    first = follow(robot, actions[30:])
    robot.restore(snapshot)
    assert follow(robot, actions[30:]) == first
    other = make_robot(name)
    other.restore(snapshot)
    assert follow(other, actions[30:]) == first


@pytest.mark.parametrize("name", [*COPIED, *REPEATED])
def test_a_snapshot_is_a_copy_where_that_restores(name: str) -> None:
    robot = make_robot(name)
    robot.reset(seed=3)
    assert (robot.snapshot().memory is not None) == (name in COPIED)


def test_a_world_that_is_used_again_repeats_itself() -> None:
    """Box2D's does not by itself; each reset makes a new one."""
    name = "BipedalWalker-v3"
    robot, actions = make_robot(name), random_actions(name, 60)
    runs = []
    for _ in range(3):
        robot.reset(seed=0)
        runs.append(follow(robot, actions))
    assert runs[0] == runs[1] == runs[2]


@pytest.mark.parametrize("name", ["Pendulum-v1", "LunarLander-v3"])
def test_steps_are_those_of_the_environment(name: str) -> None:
    robot, actions = make_robot(name), random_actions(name, 50)
    stock: gymnasium.Env[Any, Any] = gymnasium.make(name)
    np.testing.assert_array_equal(robot.reset(seed=5)[0], stock.reset(seed=5)[0])
    for action in actions:
        theirs = stock.step(action if name == "Pendulum-v1" else int(action[0]))
        ours = robot.step(action)
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:3] == theirs[1:3]


def test_attributes_are_what_is_observed_and_the_reward() -> None:
    robot = make_robot("Pendulum-v1")
    observation, _ = robot.reset(seed=1)
    assert [attribute.name for attribute in robot.attributes] == ["obs 0", "obs 1", "obs 2", "reward"]
    np.testing.assert_array_equal(robot.read_attributes(), [*observation, 0.0])
    observation, reward, *_ = robot.step(np.array([1.0], np.float32))
    np.testing.assert_array_equal(robot.read_attributes(), [*observation, reward])
    assert robot.links == ()
    assert robot.read_poses().shape == (0, 7)


@pytest.mark.parametrize(("name", "dt"), [("Pendulum-v1", 0.05), ("Acrobot-v1", 0.2), ("CartPole-v1", 0.02)])
def test_a_step_takes_what_the_environment_says(name: str, dt: float) -> None:
    assert make_robot(name).control_dt == pytest.approx(dt)


def test_a_choice_that_does_not_exist_is_named() -> None:
    robot = make_robot("CartPole-v1")
    robot.reset(seed=0)
    with pytest.raises(RobotError, match=r"CartPole-v1: expected an action of Discrete\(2\), got 2"):
        robot.step(np.array([2.0], np.float32))
    with pytest.raises(RobotError, match="expected an action of 1 numbers, got 3"):
        robot.step(np.zeros(3, np.float32))


class Picture(gymnasium.Env[Any, Any]):
    """Shows 4 × 5 bytes, counts from 3, and reports a number."""

    observation_space = spaces.Box(0, 255, (4, 5, 3), np.uint8)
    action_space = spaces.Discrete(2, start=3)

    def __init__(self) -> None:
        self.chosen: list[int] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed, options=options)
        self.chosen = []
        return np.zeros((4, 5, 3), np.uint8), {"lives": 3}

    def step(self, action: Any) -> Any:
        self.chosen.append(int(action))
        shade = int(self.np_random.integers(256))
        return np.full((4, 5, 3), shade, np.uint8), float(shade), False, False, {"lives": 2, "said": "text"}


class Emulator(Picture):
    """Holds an object of an extension module whose class looks like Python's but has no attributes."""

    def __init__(self) -> None:
        super().__init__()
        self.handle = struct.Struct("f")


class Unrepeatable(Picture):
    """Its randomness is no function of the seed, and it keeps something that no copy reaches."""

    def __init__(self) -> None:
        super().__init__()
        self.window = memoryview(b"")

    def step(self, action: Any) -> Any:
        observation, _, *rest = super().step(action)
        return observation, float(np.random.default_rng().random()), *rest


class Broken(Picture):
    def step(self, action: Any) -> Any:
        observation, _, *rest = super().step(action)
        return observation, float("nan") if len(self.chosen) > 30 else 0.0, *rest


@pytest.fixture(scope="module", autouse=True)
def registered() -> Any:
    kinds: dict[str, Any] = {
        "test/Picture-v0": Picture,
        "test/Emulator-v0": Emulator,
        "test/Unrepeatable-v0": Unrepeatable,
        "test/Broken-v0": Broken,
    }
    for name, kind in kinds.items():
        gymnasium.register(name, kind)
    yield
    for name in kinds:
        del gymnasium.registry[name]


def test_a_picture_is_passed_as_it_is_and_gives_no_attributes() -> None:
    robot: Any = make_robot("test/Picture-v0")
    observation, _ = robot.reset(seed=0)
    assert isinstance(robot, PlainGymnasiumRobot)
    assert observation.shape == (4, 5, 3)
    assert observation.dtype == np.uint8
    assert values_of(robot) == {"reward": 0.0, "lives": 3.0}
    observation, reward, *_ = robot.step(np.array([1.0], np.float32))
    assert robot.world.chosen == [4], "choices count from 0, whatever the space's own count starts with"
    assert values_of(robot) == {"reward": reward, "lives": 2.0}
    np.testing.assert_array_equal(robot.observe(), observation)


def test_an_environment_around_an_emulator_repeats_its_actions() -> None:
    robot = make_robot("test/Emulator-v0")
    robot.reset(seed=3)
    robot.step(np.array([0.0], np.float32))
    snapshot = robot.snapshot()
    assert snapshot.memory is None
    first = [robot.step(np.array([1.0], np.float32))[1] for _ in range(5)]
    robot.restore(snapshot)
    assert [robot.step(np.array([1.0], np.float32))[1] for _ in range(5)] == first


def test_an_environment_that_does_not_repeat_itself_is_an_error_and_no_silent_difference() -> None:
    robot = make_robot("test/Unrepeatable-v0")
    robot.reset(seed=0)
    robot.step(np.zeros(1, np.float32))
    snapshot = robot.snapshot()
    with pytest.raises(RobotError, match="does not repeat itself"):
        robot.restore(snapshot)


def test_a_reward_that_is_not_finite_ends_the_drive() -> None:
    robot = make_robot("test/Broken-v0")
    robot.reset(seed=0)
    with pytest.raises(SimulationDiverged, match="test/Broken-v0: the simulation diverged"):
        for _ in range(40):
            robot.step(np.zeros(1, np.float32))
