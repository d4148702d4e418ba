"""ANYmal-C: the paper's policies walk in it, commands change what is observed, snapshots are bit-exact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pdtui.api import load_policy
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import MapError
from pdtui.driving.control_loop import ControlLoop
from pdtui.robots import make_robot
from pdtui.robots.anymal import Anymal, AnymalForward
from pdtui.robots.legged.observations_and_rewards import COMMAND_SCALES
from pdtui.stimulation.map_reader import parse_map

REFERENCE = Path(__file__).parents[3] / "shared" / "reference"


def _actions(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, 12)).astype(np.float32)


@pytest.fixture
def anymal() -> Anymal:
    robot = Anymal()
    robot.reset(seed=5)
    return robot


def _actor(path: Path, observation: np.ndarray) -> np.ndarray:
    with np.load(path) as weights:
        x = observation
        for layer in (0, 2, 4):
            x = np.tanh(weights[f"actor.{layer}.weight"] @ x + weights[f"actor.{layer}.bias"])
        out: np.ndarray = weights["actor.6.weight"] @ x + weights["actor.6.bias"]
    return out


@pytest.mark.skipif(not REFERENCE.is_dir(), reason="the paper authors' weights (../shared) are not here")
@pytest.mark.parametrize(
    ("robot", "file"), [("anymal", "anymal_tanh.npz"), ("anymal-forward", "anymal_forward_tanh.npz")]
)
def test_the_authors_policies_follow_a_forward_command(robot: str, file: str) -> None:
    world = make_robot(robot)
    observation, _ = world.reset(seed=1)
    column, forward = world.attribute_index("forward"), []
    for _ in range(250):
        observation, _, fell, _, _ = world.step(_actor(REFERENCE / file, observation).astype(np.float32))
        assert not fell
        forward.append(world.read_attributes()[column])
    assert np.mean(forward[100:]) == pytest.approx(1.0, abs=0.12)


def test_it_stands_on_its_feet_and_weighs_what_the_figures_say(anymal: Anymal) -> None:
    assert anymal.model.body_mass.sum() == pytest.approx(52.14, abs=0.01)
    for _ in range(100):
        fell = anymal.step(np.zeros(12, np.float32))[2]
        assert not fell
    assert anymal.read_attributes()[anymal.attribute_index("height")] == pytest.approx(0.5, abs=0.05)


def test_a_snapshot_restores_bit_for_bit(anymal: Anymal) -> None:
    for action in _actions(5):
        anymal.step(action)
    snapshot, rest = anymal.snapshot(), _actions(20, 1)
    first = [(anymal.step(action)[1], anymal.digest()) for action in rest]
    other = Anymal()
    other.reset(seed=9)
    other.restore(snapshot)
    assert [(other.step(action)[1], other.digest()) for action in rest] == first


def test_an_observation_has_its_parts_in_their_places(anymal: Anymal) -> None:
    anymal.step(np.full(12, 0.3, np.float32))
    anymal.set_commands({"forward": 0.5, "lateral": -0.2, "yaw rate": 0.8})
    seen, data = anymal.observe(), anymal.data
    rotation = data.body("base").xmat.reshape(3, 3)
    assert seen[0] == data.qpos[2]
    np.testing.assert_allclose(seen[1:4], 2.0 * rotation.T @ data.qvel[:3], atol=2e-2)
    np.testing.assert_allclose(seen[4:7], 0.25 * data.qvel[3:6])
    np.testing.assert_allclose(seen[7:10], -rotation[2], atol=2e-2)
    np.testing.assert_allclose(seen[10:13], COMMAND_SCALES * [0.5, -0.2, 0.8])
    np.testing.assert_allclose(seen[13:25], data.qpos[7:] - anymal.description.stance)
    np.testing.assert_allclose(seen[25:37], 0.05 * data.qvel[6:])
    np.testing.assert_allclose(seen[37:], 0.3, rtol=1e-6)


def test_a_policy_that_sees_one_command_observes_two_numbers_less() -> None:
    assert AnymalForward().observe().shape == (47,)
    assert Anymal().observe().shape == (49,)


MAP = """
schema = 1
robot = "anymal"
[policy]
name = "none"
sha256 = "none"
[[behaviors]]
name = "slowly"
key = "s"
commands = {forward = 0.25}
[[behaviors]]
name = "hold heading"
key = "h"
mode = "pid"
commands = {"yaw rate" = 1.0}
pid = {attribute = "yaw", kp = 1.5, ki = 0.0, kd = 0.0, limit = 1.0, step = 0.1}
"""


def _loop(text: str = MAP) -> ControlLoop:
    import torch

    torch.manual_seed(0)
    network = torch.nn.Sequential(torch.nn.Linear(49, 8), torch.nn.Tanh(), torch.nn.Linear(8, 12))
    robot = Anymal()
    return ControlLoop(robot, load_policy(network, robot), parse_map(text, "test"), 0)


def test_behaviors_set_what_the_policy_is_asked_for() -> None:
    loop = _loop()
    column = loop.robot.attribute_index("forward command")
    assert loop.advance().attributes[column] == 1.0
    assert loop.advance([DriveEvent(1, "behavior", "slowly")]).attributes[column] == 0.25
    assert loop.advance([DriveEvent(2, "default")]).attributes[column] == 1.0
    loop.advance([DriveEvent(3, "behavior", "hold heading"), DriveEvent(3, "target", "hold heading", 0.4)])
    turned = loop.advance()
    asked = turned.attributes[loop.robot.attribute_index("yaw rate command")]
    active = turned.behaviors[0]
    assert active.magnitude is not None
    assert asked == pytest.approx(active.magnitude)
    assert asked > 0.2


def test_a_command_that_the_robot_does_not_have_is_named() -> None:
    with pytest.raises(
        MapError, match="behavior 'slowly': anymal has no command 'up'; available: forward, lat"
    ):
        _loop(MAP.replace("{forward = 0.25}", "{up = 1.0}"))
