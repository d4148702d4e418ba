"""When a ghost begins and ends, and that it is the drive without the behavior, to the last bit."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost import ghost_runner
from pdtui.driving.loop_builder import build_control_loop
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.policies.weights.weights_header import hash_file
from pdtui.robots.environments.environment_lookup import TRUSTED
from pdtui.stimulation.map_library import find_map, map_without_behaviors
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap
from tests.driving.ghost.ghost_drives import GhostDrive, ghost_drive, run_without_behaviors
from tests.driving.ghost.wandering_world import NAME
from tests.small_map import write_small_map
from tests.test_worlds import write_world

PUSH = Behavior("push", "w", "pushes", {"1:2": 2.0})


def _needs(module: str) -> pytest.MarkDecorator:
    return pytest.mark.skipif(importlib.util.find_spec(module) is None, reason=f"{module} is not installed")


@pytest.mark.parametrize(
    ("name", "start", "stochastic", "key", "steps"),
    [
        ("ant", "", False, "d", 60),
        ("ant", "", True, "d", 40),
        ("anymal-forward", "", False, "w", 40),  # its behaviors command the policy
        pytest.param("a1", "forest", False, "d", 40, marks=_needs("pybullet")),
        ("bipedal_walker", "", False, "f", 20),  # repeats its actions
        pytest.param("metadrive", "", False, "s", 15, marks=_needs("metadrive")),  # repeats them, too
    ],
)
def test_the_ghost_is_the_drive_without_the_behavior(
    name: str, start: str, stochastic: bool, key: str, steps: int
) -> None:
    stimulation_map = load_map(find_map(name))
    config = DriveConfig(stimulation_map.robot, stimulation_map, 3, start=start, stochastic=stochastic)
    with ghost_drive(config) as drive:
        drive.run(7)
        drive.run(steps, key)
        if drive.loop.robot.manual_controls:
            drive.run(5, "enter", "left")
            drive.run(5, "left")
        ghost = drive.catch_up()
        total = drive.loop.step
    rows, places = run_without_behaviors(config, drive.events, total)
    assert ghost.first == 7
    np.testing.assert_array_equal(drive.ghost_rows, rows[7:])
    np.testing.assert_array_equal(drive.ghost_path, places[7:])
    assert ghost.latest is not None
    np.testing.assert_array_equal(ghost.latest.drive_attributes, drive.loop.attributes)
    assert not np.array_equal(ghost.latest.attributes, ghost.latest.drive_attributes)


def test_the_drive_is_the_same_with_and_without_a_ghost(small_map: StimulationMap) -> None:
    config = DriveConfig("ant", small_map, 3)
    with ghost_drive(config) as drive:
        drive.run(13)
        drive.run(30, "w")
        drive.run(30, "t", "plus")
        drive.catch_up()
    alone = build_control_loop(config)
    digests = [
        alone.advance([event for event in drive.events if event.step == step]).digest for step in range(73)
    ]
    assert drive.digests == digests


def test_when_a_ghost_begins_and_ends(small_map: StimulationMap) -> None:
    with ghost_drive(DriveConfig("ant", small_map, 3)) as drive:
        assert drive.wait_for("waiting").first == -1
        drive.run(10, "t")
        assert drive.catch_up().first == 0
        drive.run(5)
        assert not drive.loop.latch.active, "the twitch is over"
        assert drive.catch_up().first == 0, "a period that runs out does not end the ghost"
        drive.run(5, "w")
        assert drive.catch_up().first == 15, "another behavior begins another ghost"
        drive.run(5, "plus")
        assert drive.catch_up().first == 15
        drive.run(5, "space")
        assert drive.wait_for("waiting").first == -1, "the default key ends it"
        drive.run(5, "h")
        assert drive.catch_up().first == 30
        drive.run(5, "h")
        assert drive.wait_for("waiting").first == -1, "and so does a behavior's own key"
        drive.run(5, "w")
        drive.run(5, "r")
        assert drive.wait_for("waiting").first == -1, "a reset ends it"
        drive.run(70, "w")
        assert drive.catch_up().first == 50
        drive.run(5, "backspace")
        assert drive.catch_up().first == 120, "where a rewind leads to a latched behavior, another begins"
        drive.tracker.toggle()
        assert (drive.look(), drive.tracker.pid) == (None, 0)
        drive.tracker.toggle()
        drive.run(5)
        assert drive.catch_up().first == 125, "turned on while a behavior is latched, it begins there"


def test_a_ghost_ends_with_the_episode_of_the_drive() -> None:
    stimulation_map = load_map(find_map("bipedal_walker"))
    with ghost_drive(DriveConfig("bipedal_walker", stimulation_map, 3)) as drive:
        drive.run(20)
        drive.run(1, "f")
        _run_until_the_episode_ends(drive)
        assert drive.wait_for("waiting").first == -1


def _run_until_the_episode_ends(drive: GhostDrive) -> None:
    episode = drive.loop.episode
    for _ in range(1000):
        drive.run(1)
        if drive.loop.episode != episode:
            return
    raise AssertionError("the episode did not end")


def test_a_ghost_whose_own_episode_is_over_says_how_and_stays(tmp_path: Path) -> None:
    """An untrained Hopper falls later with the push than without."""
    config = DriveConfig("Hopper-v5", load_map(write_world("Hopper-v5", tmp_path)), 1)
    with ghost_drive(config) as drive:
        drive.run(1)
        drive.run(20, "w")
        ghost = drive.wait_for("over")
        assert ghost.latest is not None
        fell = ghost.latest.step
        drive.run(2)
        later = drive.wait_for("over")
        assert drive.loop.episode == 0
    assert 1 < fell < 21
    assert later.message == ghost.message == "the environment ended the episode"
    assert len(drive.ghost_rows) == fell - 1


def test_a_ghost_that_is_too_far_behind_is_given_up(
    small_map: StimulationMap, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ghost_runner, "MOST_BEHIND", 30)
    with ghost_drive(DriveConfig("ant", small_map, 3)) as drive:
        drive.run(40, "w")  # the ghost's process is still loading
        ghost = drive.wait_for("failed")
        assert ghost.message == "the ghost was given up: it was more than 30 steps behind"
        assert drive.tracker.notice == ghost.message
        assert drive.tracker.pid == 0


def test_a_world_that_does_not_repeat_itself_has_no_ghost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(TRUSTED, NAME.partition(":")[0])
    weights = tmp_path / "small.safetensors"
    spec = NetworkSpec(NAME, 3, (8, 8), "tanh", 1, "mean", (-1.0,), (1.0,))
    save_network(weights, PolicyNetwork(spec))
    alone = map_without_behaviors(NAME, str(weights))
    stimulation_map = replace(alone, policy_hash=hash_file(weights), behaviors={"push": PUSH})
    with ghost_drive(DriveConfig(NAME, stimulation_map, 3)) as drive:
        drive.run(3)
        drive.run(5, "w")
        ghost = drive.wait_for("failed")
        drive.run(5)
    assert ghost.message.startswith("no ghost: ")
    assert ghost.message.endswith("the environment does not repeat itself from the same seed and actions")


def test_a_drive_whose_policy_is_gone_has_no_ghost(tmp_path: Path) -> None:
    path = write_small_map(tmp_path)
    with ghost_drive(DriveConfig("ant", load_map(path), 3)) as drive:
        drive.tracker.toggle()
        (tmp_path / "small.safetensors").unlink()
        drive.tracker.toggle()
        ghost = drive.wait_for("failed")
        assert "no policy" in ghost.message
        assert drive.tracker.notice == ghost.message
