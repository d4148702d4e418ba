"""pdtui from Python: the examples in its docstrings, and networks in memory from end to end."""

from __future__ import annotations

import doctest
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from torch import nn

import pdtui
import pdtui.api
from pdtui.core.errors import KeystrokeError, MapError, PolicyError, SessionError
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.robot import Robot
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.small_dissection import SMALL
from tests.small_worlds import Dot, Pole, initial_state, trained_conv, trained_lstm

_MAP = """\
schema = 1
robot = "{robot}"

[policy]
name = "{policy}"
sha256 = "{sha256}"

[[behaviors]]
name = "push"
key = "w"
magnitudes = {{ "{unit}" = 0.3 }}
"""


def _dot() -> tuple[Robot, Policy, StimulationMap]:
    robot = Dot()
    policy = pdtui.load_policy(trained_conv(), robot, batched=True, name="dot")
    return robot, policy, _map(robot, policy, "features.0:10")


def _pole() -> tuple[Robot, Policy, StimulationMap]:
    robot = Pole()
    policy = pdtui.load_policy(trained_lstm(), robot, initial_state=initial_state(), name="pole")
    return robot, policy, _map(robot, policy, "lstm:7")


def _map(robot: Robot, policy: Policy, unit: str) -> StimulationMap:
    return parse_map(
        _MAP.format(robot=robot.name, policy=policy.name, sha256=policy.sha256, unit=unit), "map"
    )


def test_the_examples_in_the_docstrings_hold() -> None:
    results = doctest.testmod(pdtui.api)
    assert results.attempted > 15
    assert results.failed == 0


def test_importing_pdtui_loads_nothing_heavy() -> None:
    heavy = ["torch", "numpy", "gymnasium", "mujoco", "rerun", "textual"]
    code = f"import sys, pdtui; dir(pdtui); print([m for m in {heavy!r} if m in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


@pytest.mark.parametrize("world", [_dot, _pole])
def test_a_recorded_drive_of_a_live_network_replays_bit_for_bit_with_a_rewind(
    world: object, tmp_path: Path
) -> None:
    assert callable(world)
    robot, policy, stimulation_map = world()
    path = tmp_path / "drive.rrd"
    keys = {20: "w", 35: ["space"], 60: "backspace", 80: "r"}
    drive = pdtui.drive(
        robot, stimulation_map, policy=policy, keys=keys, steps=110, seed=4, stochastic=False, record=path
    )
    assert [event.kind for event in drive.events] == ["behavior", "default", "rewind", "reset"]
    (unit,) = drive.stimulations[25].units
    np.testing.assert_array_equal(drive.activations[20:35, unit], np.float32(0.3))
    back = int(drive.events[2].value)
    np.testing.assert_array_equal(drive.activations[60:65], drive.activations[back : back + 5])
    again_robot, again_policy, _ = world()
    result = pdtui.replay(path, robot=again_robot, policy=again_policy)
    assert (result.steps, result.first_difference) == (110, None)
    with pytest.raises(SessionError, match=r"drive.rrd: already exists"):
        pdtui.drive(robot, stimulation_map, policy=policy, record=path)


@pytest.mark.parametrize("world", [_dot, _pole])
def test_a_live_network_is_dissected(world: object) -> None:
    assert callable(world)
    robot, policy, _ = world()
    found = pdtui.dissect(robot, policy, episodes=2, settings=SMALL)
    assert found.screen.effects.shape[:2] == (policy.units, 2)
    assert np.abs(np.nan_to_num(found.screen.effects)).max() > 0
    assert repr(found).startswith(f"<Dissection of {policy.name} on {robot.name}: {policy.units} units")
    nearest = found.matches(robot.attributes[0].name, 3)
    names = {address.partition(":")[0] for address in nearest}
    assert names <= {"features.0", "fc", "lstm"}
    proposed = found.to_map()
    proposed.check(robot.name, policy.layers, policy.sha256)


class CountedWorld(gymnasium.Env[Any, Any]):
    """Counts how often it is built, and how many of it are not closed."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (3,))
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
    built = 0
    open = 0

    def __init__(self, **_: Any) -> None:
        CountedWorld.built += 1
        CountedWorld.open += 1
        self._open = True

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        return np.zeros(3), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return np.full(3, action[0]), 0.0, False, False, {}

    def close(self) -> None:
        CountedWorld.open -= self._open
        self._open = False


def test_worlds_are_built_once_and_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = "CountedWorld-v0"
    monkeypatch.setitem(gymnasium.registry, name, gymnasium.envs.registration.EnvSpec(name, CountedWorld))
    network = nn.Sequential(nn.Linear(3, 4), nn.Tanh(), nn.Linear(4, 2))
    policy = pdtui.load_policy(network, name)
    once, CountedWorld.built = CountedWorld.built, 0
    stimulation_map = parse_map(
        _MAP.format(robot=name, policy="live", sha256=policy.sha256, unit="0:1"), "map"
    )
    path = tmp_path / "drive.rrd"
    drive = pdtui.drive(name, stimulation_map, policy=policy, steps=3)
    driven, CountedWorld.built = CountedWorld.built, 0
    again = pdtui.drive(name, stimulation_map, policy=network, steps=3, record=path)
    np.testing.assert_array_equal(again.actions, drive.actions)
    assert CountedWorld.built == driven
    assert pdtui.replay(path, policy=network).identical
    CountedWorld.built = 0
    with pytest.raises(MapError, match="no map 'nothing'"):
        pdtui.dissect(name, network, start_from="nothing")
    assert CountedWorld.built == once
    with pytest.raises(PolicyError, match="no policy 'nothing'"):
        pdtui.dissect(name, "nothing")
    assert CountedWorld.open == 0


def test_arrays_are_addressed_by_name() -> None:
    robot, policy, stimulation_map = _dot()
    drive = pdtui.drive(robot, stimulation_map, policy=policy, keys={5: "w"}, steps=12)
    assert len(drive) == 12
    np.testing.assert_array_equal(drive["x"], drive.attributes[:, 0])
    np.testing.assert_array_equal(drive.unit("features.0:10")[5:], np.float32(0.3))
    np.testing.assert_array_equal(drive.unit("0:10"), drive.activations[:, 10])
    assert drive.behaviors[4:6] == ((), ("push",))
    assert repr(drive) == "<Drive of dot by dot: 12 steps (0.6 s), 1 events, falls 0>"


def test_changed_weights_are_another_policy() -> None:
    robot, policy, stimulation_map = _dot()
    network = trained_conv()
    with pytest.raises(MapError, match="made for a policy with SHA-256"):
        other = pdtui.load_policy(nn.Sequential(nn.Flatten(0), nn.Linear(72, 8), nn.Tanh()), robot)
        pdtui.drive(robot, stimulation_map, policy=other)
    assert pdtui.load_policy(network, robot, batched=True).sha256 == policy.sha256


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: pdtui.load_policy(nn.Linear(2, 2)), PolicyError, "Linear: expected the shape of the obs"),
        (lambda: pdtui.load_policy("nothing"), PolicyError, "no policy 'nothing'"),
        (lambda: pdtui.drive("ant", keys={0: "z"}, steps=1), KeystrokeError, "step 0: key 'z'"),
        (lambda: pdtui.nothing, AttributeError, "module 'pdtui' has no attribute 'nothing'"),
    ],
)
def test_errors(call: object, error: type[Exception], message: str) -> None:
    assert callable(call)
    with pytest.raises(error, match=message):
        call()
