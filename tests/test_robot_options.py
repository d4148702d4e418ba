"""A robot's options from the command line, a map and Python: the same world in drive, session and replay."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import pdtui
from pdtui.cli import main
from pdtui.core.errors import MapError, RobotError
from pdtui.dissection.search_task_into_map import search_task_into_map
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots import RobotSpec
from pdtui.robots.robot import Robot
from pdtui.search.task_search_settings import QUICK_TASK_SEARCH
from pdtui.sessions.session_header import read_session_header
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map, parse_map

STRONG = "[robot_options]\ntorque = 100  # N m\n"


def run(*arguments: str | Path | int) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def weak_map(tmp_path: Path) -> Path:
    """The BipedalWalker's map for weaker motors."""
    path = tmp_path / "weak.toml"
    path.write_text(f"{find_map('bipedal_walker').read_text()}\n{STRONG}")
    return path


def test_a_drive_has_the_maps_options_and_replays_without_the_map(weak_map: Path, tmp_path: Path) -> None:
    session = tmp_path / "weak.rrd"
    drive = run("drive", weak_map, "--headless", "--steps", 60, "--record", session)
    assert drive.exit_code == 0, drive.output
    weak_map.unlink()
    assert read_session_header(session).info.robot_options == {"torque": 100.0}
    assert run("sessions", "verify", session).output.endswith("identical: 60 steps\n")
    shown = run("sessions", "show", session)
    assert "torque = 100" in shown.output
    assert json.loads(run("sessions", "show", session, "--json").output)["robot_options"] == {"torque": 100.0}


def test_sessions_of_other_options_differ_in_words(tmp_path: Path) -> None:
    for name, options in (("either", {}), ("x", {"forward": "x"})):
        pdtui.drive(RobotSpec("ant", options), steps=10, record=tmp_path / f"{name}.rrd")
    assert read_session_header(tmp_path / "either.rrd").info.robot_options == {}
    compared = run("sessions", "compare", tmp_path / "x.rrd", tmp_path / "either.rrd")
    assert "robot options: forward = x and none" in compared.output


def test_the_command_line_takes_precedence_over_the_map(weak_map: Path, tmp_path: Path) -> None:
    session = tmp_path / "weak.rrd"
    arguments: list[str | Path | int] = ["drive", weak_map, "--robot-option", "torque=80", "--headless"]
    drive = run(*arguments, "--steps", 40, "--record", session)
    assert drive.exit_code == 0, drive.output
    assert f"{weak_map}: made for torque = 100; the robot is built with torque = 80" in drive.stderr
    info = read_session_header(session).info
    assert info.robot_options == parse_map(info.map_text, "m").robot_options == {"torque": 80.0}
    assert info.map_text.startswith(weak_map.read_text().splitlines()[0])
    assert load_map(weak_map).robot_options == {"torque": 100}
    assert run("replay", session).stdout == "identical: 40 steps\n"


def test_a_session_that_was_cut_off_is_repaired_with_its_options(weak_map: Path, tmp_path: Path) -> None:
    session, repaired = tmp_path / "weak.rrd", tmp_path / "repaired.rrd"
    run("drive", weak_map, "--headless", "--steps", 60, "--record", session)
    session.write_bytes(session.read_bytes()[:-2000])
    repair = run("sessions", "repair", session, "-o", repaired)
    assert repair.exit_code == 0, repair.output
    assert read_session_header(repaired).info.robot_options == {"torque": 100.0}
    assert run("replay", repaired).exit_code == 0


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('torque = "strong"', r"field 'torque': expected a number, found 'strong'"),
        ("power = 3", r"field 'power': no such option; available: torque \(a number, default 300\)"),
    ],
)
def test_what_the_robot_does_not_take_is_named_with_the_maps_line(
    line: str, said: str, weak_map: Path
) -> None:
    text = weak_map.read_text().replace("torque = 100", line)
    weak_map.write_text(text)
    number = 1 + next(row for row, one in enumerate(text.splitlines()) if one.startswith(line))
    with pytest.raises(MapError, match=rf"weak\.toml:{number}: robot_options: {said}"):
        pdtui.drive("bipedal_walker", weak_map, steps=1)


def test_what_is_typed_wrongly_is_refused_by_name() -> None:
    for typed, said in (
        ("torque=strong", "--robot-option torque=strong: expected a number, found 'strong'"),
        ("power=3", "--robot-option power=3: no such option; available: torque (a number, default 300)"),
        ("torque", "--robot-option torque: expected torque=VALUE with a number"),
    ):
        result = run("drive", "bipedal_walker", "--robot-option", typed, "--headless")
        assert (result.exit_code, result.output) == (1, f"pdtui: robot 'bipedal_walker': {said}\n")
    listed = run("evaluate", "bipedal_walker", "--robot-option", "help")
    assert listed.exit_code == 0
    assert listed.output.startswith("torque (a number, default 300): Torque of the strongest motor command")
    assert run("dissect", "--env", "MountainCar-v0", "--robot-option", "help").output.startswith(
        "goal_velocity (a number, default 0)"
    )


def test_what_was_measured_in_another_world_is_not_written_into_the_map(weak_map: Path) -> None:
    option = "--robot-option", "torque=80"
    assert (
        "--update cannot be used with --robot-option" in run("evaluate", weak_map, *option, "--update").output
    )
    assert "--robot-option needs --dry-run" in run("tune", weak_map, "--all", *option).output
    with pytest.raises(
        MapError, match=r"expected the map's robot options \(torque = 100\), found torque = 80"
    ):
        search_task_into_map(
            RobotSpec("bipedal_walker", {"torque": 80.0}),
            "jump",
            "bipedal_walker",
            weak_map,
            seed=1000,
            workers=1,
            minutes=1.0,
            settings=QUICK_TASK_SEARCH,
        )


def _read_torque(robot: Robot, policy: Policy, _: int) -> object:
    return robot.build_options["torque"], robot.attributes[robot.attribute_index("hip 1 torque")].scale


def test_worker_processes_build_the_same_world() -> None:
    with RolloutPool(RobotSpec("bipedal_walker", {"torque": 80}), "bipedal_walker", workers=2) as pool:
        assert pool.map(_read_torque, range(4)) == [(80.0, 1 / 80)] * 4


def test_python_takes_a_name_with_options(tmp_path: Path) -> None:
    session = tmp_path / "weak.rrd"
    weak = pdtui.drive(pdtui.RobotSpec("bipedal_walker", {"torque": 80}), steps=30, record=session)
    assert weak.info.robot_options == {"torque": 80.0}
    assert pdtui.replay(session).identical
    with pytest.raises(RobotError, match="option 'torque': expected a number, found 'much'"):
        RolloutPool(pdtui.RobotSpec("bipedal_walker", {"torque": "much"}), "bipedal_walker")


def test_an_environments_options_are_recorded_as_well(tmp_path: Path) -> None:
    from torch import nn

    network = nn.Sequential(nn.Linear(3, 4), nn.Tanh(), nn.Linear(4, 1))
    policy = pdtui.load_policy(network, "Pendulum-v1")
    text = f'schema = 1\nrobot = "Pendulum-v1"\n\n[policy]\nname = "swing"\nsha256 = "{policy.sha256}"\n'
    stimulation_map = parse_map(f"{text}\n[robot_options]\ng = 1.5\n", "swing")
    session = tmp_path / "swing.rrd"
    light = pdtui.drive("Pendulum-v1", stimulation_map, policy=policy, steps=20, record=session)
    usual = pdtui.drive("Pendulum-v1", parse_map(text, "swing"), policy=policy, steps=20)
    assert abs(light["obs 2"][-1] - usual["obs 2"][-1]) > 0.1  # it turns at another speed
    assert read_session_header(session).info.robot_options == {"g": 1.5}
    assert pdtui.replay(session, policy=policy).identical


def test_converted_weights_fit_worlds_that_differ_by_options_and_others_when_asked(tmp_path: Path) -> None:
    from pdtui.policies.weights.policy_file_lookup import SHIPPED_WEIGHTS

    weights, other = SHIPPED_WEIGHTS / "bipedal_walker.safetensors", tmp_path / "other.safetensors"
    alone = "--headless", "--steps", 3, "--no-record"
    weak = run("drive", "bipedal_walker", "--policy", weights, "--robot-option", "torque=80", *alone)
    assert weak.exit_code == 0, weak.output
    refused = run("drive", "BipedalWalker-v3", "--policy", weights, *alone)
    assert refused.exit_code == 1
    assert "found one for 'bipedal_walker'; `pdtui convert" in refused.output
    converted = run("convert", weights, "--robot", "BipedalWalker-v3", "-o", other)
    assert converted.exit_code == 0, converted.output
    assert run("drive", "BipedalWalker-v3", "--policy", other, *alone).exit_code == 0
    unfit = run("convert", weights, "--robot", "ant", "-o", tmp_path / "ant.safetensors")
    assert "expected observations of shape (27,) and actions of shape (8,), as ant has" in unfit.output
    assert not (tmp_path / "ant.safetensors").exists()
    rows = run(
        "convert", weights, "-o", tmp_path / "short.safetensors", "--robot", "Ant-v5",
        "--robot-option", "include_cfrc_ext_in_observation=false",
    )  # fmt: skip
    assert "expected observations of shape (27,)" in rows.output  # not the 105 that it has by default
