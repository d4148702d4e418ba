"""Any environment, end to end: dissect it, drive its map, record, replay, and see it on the screen."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from click.testing import CliRunner, Result
from gymnasium.envs.classic_control import PendulumEnv

from pdtui.cli import main
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveFacts
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.snapshot_builder import SnapshotBuilder
from pdtui.policies.weights.policy_network import Head, NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.policies.weights.weights_header import hash_file
from pdtui.robots import make_robot
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.map_reader import load_map
from pdtui.tui.drive_app import DriveApp
from tests.tui.conftest import Message, ScriptedConnection
from tests.tui.screens import played, shown

MAP = """\
schema = 1
robot = "{robot}"

[policy]
name = "{policy}"
sha256 = "{sha256}"

[[behaviors]]
name = "push"
key = "w"
magnitudes = {{ "1:2" = 2.0 }}

[[behaviors]]
name = "hold"
key = "h"
mode = "pid"
magnitudes = {{ "0:5" = 1.0 }}
pid = {{ attribute = "{attribute}", kp = 2.0, ki = 0.1, kd = 0.05, limit = 3.0, step = 0.1 }}
"""

# Observations, actions, their bounds where they are no choices, and an attribute to hold.
WORLDS = {
    "Hopper-v5": (11, 3, 1.0, "height"),
    "Pendulum-v1": (3, 1, 2.0, "obs 2"),
    "CartPole-v1": (4, 2, None, "obs 0"),
    "LunarLander-v3": (8, 4, None, "obs 1"),
}


def write_world(robot: str, folder: Path, *, name: str = "") -> Path:
    """A small seeded policy and a map for it; the map's path."""
    observations, actions, bound, attribute = WORLDS[robot]
    torch.manual_seed(7)
    high = () if bound is None else (bound,) * actions
    low = tuple(-one for one in high)
    weights = folder / "small.safetensors"
    head: Head = "categorical" if bound is None else "mean"
    spec = NetworkSpec(name or robot, observations, (8, 8), "tanh", actions, head, low, high)
    save_network(weights, PolicyNetwork(spec))
    path = folder / "world.toml"
    path.write_text(
        MAP.format(robot=name or robot, policy=weights, sha256=hash_file(weights), attribute=attribute)
    )
    return path


def run(*arguments: str | Path | float) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.mark.parametrize("robot", WORLDS)
def test_a_drive_with_rewind_and_reset_replays_bit_for_bit(robot: str, tmp_path: Path) -> None:
    path, session, keys = write_world(robot, tmp_path), tmp_path / "out.rrd", tmp_path / "keys.txt"
    back = round(3 / make_robot(robot).control_dt) + 25
    keys.write_text(f"5 w\n12 h\n13 up\n{back} backspace\n{back + 2} w\n{back + 20} r\n{back + 30} h\n")
    steps = back + 50
    driven = run("drive", path, "--headless", "--keys", keys, "--steps", steps, "--record", session)
    assert driven.exit_code == 0, driven.output
    replayed = subprocess.run(
        [sys.executable, "-m", "pdtui", "replay", str(session)], capture_output=True, text=True, check=False
    )
    assert replayed.stdout == f"identical: {steps} steps\n", replayed.stderr
    info = read_session(session).info
    assert info.robot == robot
    assert "reward" in [attribute.name for attribute in info.attributes]


@pytest.mark.parametrize("robot", ["Hopper-v5", "Pendulum-v1"])
@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_the_screen_shows_it(robot: str, size: tuple[int, int], tmp_path: Path) -> None:
    stimulation_map = load_map(write_world(robot, tmp_path))
    loop = build_control_loop(DriveConfig(robot, stimulation_map, 3))
    observer = SnapshotBuilder(loop)
    messages: list[Message] = [
        DriveFacts(robot, "small", 3, loop.robot.control_dt, loop.robot.attributes, loop.robot.links, (8, 8))
    ]
    for step in range(40):
        observer.add_step(loop.advance([DriveEvent(39, "behavior", "push", key="w")] if step == 39 else []))
        if step % 4 == 3:
            messages.append(
                observer.build_snapshot(
                    paused=False, speed=1.0, achieved_speed=1.0, recorded_bytes=0, finished=""
                )
            )
    link = ScriptedConnection(messages)
    app = DriveApp(link, stimulation_map, fps=200)
    async with app.run_test(size=size) as pilot:
        await played(pilot, link)
        await pilot.press("v")
        await pilot.pause(0.02)
        assert robot in shown(app.query_one("#status"))
        assert "▌push" in shown(app.query_one("#behaviors"))
        attributes, body = shown(app.query_one("#attributes")), app.query_one("#robot")
        if robot == "Pendulum-v1":
            assert not body.display
            assert all(f"obs {index}" in attributes for index in range(3))
            assert "reward" in attributes
            assert app.query_one("#attributes").outer_size.height > 8, (
                "the room of the body is the attributes'"
            )
        else:
            assert "height" in attributes
            assert any("⠀" < letter <= "⣿" for letter in shown(body)), "the hopper is drawn"
            assert " m" in shown(app.query_one("#path"))


def test_measuring_commands_take_a_world_without_speed(tmp_path: Path) -> None:
    path = write_world("Pendulum-v1", tmp_path)
    walked = run("evaluate", path, "--seeds", "100", "--policy-only", "--json")
    assert walked.exit_code == 0, walked.output
    data = json.loads(walked.output)
    assert (data["mean_speed"], data["net_speed"]) == (None, None)
    assert data["outcomes"] == {"fell": 0, "out of time": 1}
    table = run("evaluate", path, "--seeds", "100", "--policy-only")
    assert "return" in table.output
    assert "mean speed" not in table.output
    held = run("evaluate", path, "--seeds", "100", "--target", "obs 2", "--json")
    assert held.exit_code == 0, held.output
    assert np.isfinite(json.loads(held.output)["error"])
    bench = run("bench", "loop", path, "--steps", 100, "--json")
    assert json.loads(bench.output)["recorded"] > 0


def test_dissect_takes_an_environment_and_its_map_drives(tmp_path: Path) -> None:
    write_world("Pendulum-v1", tmp_path)
    output = tmp_path / "out.toml"
    weights = tmp_path / "small.safetensors"
    result = run(
        "dissect", "--env", "Pendulum-v1", "--policy", weights, "-o", output, "--quick",
        "--budget", 0.001, "--workers", 2, "--json", "--figures", tmp_path / "figures",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    pictures = [Path(path) for path in json.loads(result.stdout)["pictures"]]
    assert pictures[0] == tmp_path / "out.rrd"
    assert pictures[1] == tmp_path / "figures" / "spectrograms.png"
    assert all(path.stat().st_size > 1000 for path in pictures)
    assert load_map(output).robot == "Pendulum-v1"
    driven = run("drive", output, "--headless", "--steps", 20, "--no-record")
    assert "20 steps, 1 s simulated" in driven.output, driven.output


def test_mistakes_are_one_line(tmp_path: Path) -> None:
    both = run("dissect", "ant", "--env", "Hopper-v5")
    assert "expected either ROBOT or --env ID" in both.output
    unknown = run("dissect", "--env", "Hoper-v5", "--policy", "x")
    assert unknown.output.startswith("pdtui: unknown robot 'Hoper-v5'; did you mean Hopper-v5")
    path = write_world("Hopper-v5", tmp_path, name="Walker2d-v5")
    unfit = run("drive", path, "--headless", "--steps", 5)
    assert "shape (17,)" in unfit.output
    assert "shape (11,)" in unfit.output
    trained = run("train", "Hopper-v5", "--folder", tmp_path / "runs")
    assert "pdtui: expected one of pdtui's own robots (a1, a1-vision, ant, anymal, " in trained.output


def test_a_map_does_not_choose_modules_to_import(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delenv("PDTUI_ENVIRONMENT_MODULES", raising=False)
    (tmp_path / "evil_module.py").write_text("raise SystemExit('was imported')\n")
    path = write_world("Pendulum-v1", tmp_path, name="evil_module:Pendulum-v1")
    result = run("drive", path, "--headless", "--steps", 5)
    assert result.exit_code == 1
    assert "the module 'evil_module' is not imported because a map or a session says so" in result.output


def test_a_module_named_on_the_command_line_is_imported_for_its_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PDTUI_ENVIRONMENT_MODULES", "")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{Path(__file__).parents[1]}")
    (tmp_path / "good_module.py").write_text("")
    path = write_world("Pendulum-v1", tmp_path, name="good_module:Pendulum-v1")
    command = [sys.executable, "-m", "pdtui", "drive", "good_module:Pendulum-v1", "--map", str(path)]
    result = subprocess.run(
        [*command, "--headless", "--steps", "5"], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert result.stdout.startswith("5 steps"), result.stderr


def test_a_module_is_found_in_the_working_directory_by_the_installed_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python does not look there when it runs an installed command, which `-P` stands for."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]))
    (tmp_path / "my_worlds.py").write_text(
        "import gymnasium\n"
        "from gymnasium.envs.classic_control import PendulumEnv\n"
        "class Mine(PendulumEnv):\n"
        "    pass\n"
        "gymnasium.register('Mine-v0', entry_point=Mine)\n"
    )
    policy = Path(__file__).parent / "fixtures" / "sb3-pendulum.zip"

    def pdtui(*arguments: str | Path) -> str:
        command = [sys.executable, "-P", "-m", "pdtui", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    world = "my_worlds:Mine-v0"
    drive = pdtui("drive", world, "--policy", policy, "--headless", "--steps", "5", "--no-record")
    assert drive.startswith("5 steps")
    measured = ("--policy", policy, "--policy-only", "--seeds", "1-2", "--json")
    assert json.loads(pdtui("evaluate", world, *measured))["steps"] > 0


class _ManyAgents:
    """What PettingZoo's parallel worlds look like."""

    possible_agents = ("one", "other")

    def close(self) -> None:
        pass


class _ManyPendulums(PendulumEnv):
    """An environment that runs several worlds, as those of simulators on a GPU do."""

    num_envs = 4


@pytest.fixture
def crowded() -> Iterator[None]:
    """Worlds of several agents, or several at once, that are registered with Gymnasium."""
    kinds: dict[str, dict[str, Any]] = {
        "test/Agents-v0": {"entry_point": _ManyAgents},
        "test/Vector-v0": {"entry_point": lambda: gymnasium.make_vec("CartPole-v1", num_envs=3)},
        "test/OnlyVector-v0": {"vector_entry_point": lambda: gymnasium.make_vec("CartPole-v1", num_envs=3)},
        "test/Pendulums-v0": {"entry_point": _ManyPendulums},
    }
    for name, points in kinds.items():
        gymnasium.register(name, **points)
    yield
    for name in kinds:
        del gymnasium.registry[name]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pistonball_v6", "unknown robot 'pistonball_v6'; worlds of PettingZoo have such names, but pdtui"),
        ("pettingzoo.mpe:simple_v3", "'pettingzoo.mpe:simple_v3' is a world of PettingZoo; pdtui"),
        ("test/Agents-v0", "environment 'test/Agents-v0' is a world of PettingZoo, or one like them; pdtui"),
        ("test/Vector-v0", "environment 'test/Vector-v0' is vectorized: it runs 3 worlds at once; pdtui"),
        ("test/OnlyVector-v0", "environment 'test/OnlyVector-v0' is registered as vectorized only; pdtui"),
        (
            "test/Pendulums-v0",
            "environment 'test/Pendulums-v0' is vectorized: it runs 4 worlds at once; pdtui",
        ),
    ],
)
@pytest.mark.usefixtures("crowded")
def test_only_one_agent_in_one_world_is_driven(name: str, said: str) -> None:
    policy = Path(__file__).parent / "fixtures" / "sb3-pendulum.zip"
    refused = run("drive", name, "--policy", policy, "--headless", "--no-record")
    assert refused.exit_code == 1
    (line,) = [one for one in refused.output.splitlines() if "driving without behaviors" not in one]
    assert line == f"pdtui: {said} drives single-agent worlds only: one agent, in one world at a time"
