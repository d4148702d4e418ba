"""What is shipped: policies, their maps and sample sessions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.core.outcome import Outcome, count_failures
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.weights_file import load_network
from pdtui.policies.weights.weights_header import hash_file
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.map_library import find_map, shipped_folder
from pdtui.stimulation.map_reader import load_map

LEAST = {
    "a1": {"left": 18, "right": 17, "forward": 18},
    "walker": {"slow down": 6},
    "bipedal_walker": {"jump": 12, "front flip": 10, "stand up": 10},
}
"""Of 20 seeds; the README has what was measured."""
SAMPLES = sorted((shipped_folder("sessions") / "samples").glob("*.rrd"))


def _require_simulator(robot: str) -> None:
    """Skip the test where the robot's simulator has no wheels for this Python, or was not installed."""
    module = {"a1": "pybullet", "metadrive": "metadrive"}.get(robot)
    if module is not None:
        pytest.importorskip(module, reason=f"{module} is not installed (it has no wheels for every Python)")


def _failures(figures: Mapping[str, Any]) -> int:
    return count_failures({Outcome(word): count for word, count in figures["outcomes"].items()})


def _figures(*arguments: str) -> dict[str, object]:
    result = CliRunner().invoke(main, [*arguments, "--json"])
    assert result.exit_code == 0, result.output
    data: dict[str, object] = json.loads(result.output)
    return data


def test_there_is_a_sample() -> None:
    assert SAMPLES


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_a_sample_driven_on_the_screen_replays_bit_for_bit(path: Path) -> None:
    _require_simulator(path.stem)
    session = read_session(path)
    assert any(event.key for event in session.events)
    result = replay_session(path)
    if result.environment and result.first_difference is not None:
        # Another processor sums in another order: the session has to repeat within the tolerance.
        assert result.passed, result.verdict
        pytest.skip(f"bits differ from step {result.first_difference} on: {'; '.join(result.environment)}")
    assert result.first_difference is None, result.detail
    assert result.steps == session.steps


@pytest.mark.parametrize(
    ("robot", "layers", "behaviors"),
    [
        ("a1", (256,) * 4, {"bend left", "bend right", "slow to a patter", "forward"}),
        ("anymal", (128, 64, 32), {"left", "right", "hold heading", "hold heading by command"}),
        ("ant", (256, 256), {"stop", "drift left", "drift right", "turn left", "spin right"}),
        ("walker", (256, 256), {"brake"}),
        ("bipedal_walker", (256, 256), {"jump", "front flip", "rise from split"}),
        ("metadrive", (256, 256), {"brake", "accelerate", "lane left", "lane right"}),
    ],
)
def test_the_weights_say_how_they_were_trained_and_the_map_fits_them(
    robot: str, layers: tuple[int, ...], behaviors: set[str]
) -> None:
    _require_simulator(robot)
    spec = load_network(find_weights_file(robot)).spec
    assert (spec.layers, spec.activation, spec.head) == (layers, "tanh", "squashed_gaussian")
    assert spec.command.startswith(f"pdtui train {robot} --algorithm ppo --seed ")
    assert spec.score["episodes"] >= 20
    shipped = load_map(find_map(robot))
    assert behaviors <= shipped.behaviors.keys()
    shipped.check(robot, spec.layers, hash_file(find_weights_file(robot)))
    build_control_loop(DriveConfig(robot, shipped, 0))


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "least"), [("walker", 4000.0), ("bipedal_walker", 280.0)])
def test_the_other_policies_earn_what_is_wanted(robot: str, least: float) -> None:
    figures = _figures("evaluate", robot, "--policy-only", "--seeds", "100-119")
    assert _failures(figures) <= 1
    assert float(str(figures["mean_return"])) >= least


@pytest.mark.slow
@pytest.mark.parametrize("robot", LEAST)
def test_every_task_is_done_as_often_as_the_readme_says(robot: str) -> None:
    figures = _figures("evaluate", robot, "--seeds", "100-119")
    tasks = figures["tasks"]
    rows = {row["task"]: row for row in tasks if row["condition"] == "undisturbed" and not row["after"]}  # type: ignore[attr-defined]
    for task, least in LEAST[robot].items():
        assert rows[task]["done"] >= least, rows[task]
        assert rows[task]["done"] > rows[task]["by_itself"]


@pytest.mark.slow
def test_the_policy_walks() -> None:
    figures = _figures("evaluate", "ant", "--policy-only", "--seeds", "100-119")
    assert _failures(figures) <= 1
    assert float(str(figures["mean_speed"])) >= 4.5


@pytest.mark.slow
def test_every_behavior_of_the_ant_does_something_at_first() -> None:
    figures = _figures("evaluate", "ant", "--seeds", "100-119", "--quick")
    rows = [row for row in figures["behaviors"] if row["condition"] == "undisturbed"]  # type: ignore[attr-defined]
    first = {row["behavior"]: row["first"] for row in rows}
    assert first["stop"]["value"] < 0.2 * first["stop"]["default"]
    for name, sign, least in (
        ("drift left", 1, 0.7),
        ("drift right", -1, 0.7),
        ("turn left", 1, 0.4),
        ("spin right", -1, 0.3),
    ):
        assert sign * first[name]["value"] >= least
    assert all(_failures(row) <= 1 for row in rows)


@pytest.mark.slow
def test_the_a1_walks_on_rough_ground() -> None:
    figures = _figures("evaluate", "a1", "--policy-only", "--start", "rough", "--seeds", "100-119")
    assert _failures(figures) <= 2
    assert float(str(figures["net_speed"])) >= 1.0


@pytest.mark.slow
def test_anymal_follows_its_commands() -> None:
    figures = _figures("evaluate", "anymal", "--experiment", "commands", "--seeds", "100-119")
    assert _failures(figures) <= 1
    errors = {row["command"]: row["error"] for row in figures["commands"]}  # type: ignore[attr-defined]
    assert errors["forward"] <= 0.1
    assert errors["yaw rate"] <= 0.1


@pytest.mark.slow
def test_units_hold_anymals_heading_nearly_as_well_as_its_command() -> None:
    figures = _figures("evaluate", "anymal", "--experiment", "tracking", "--seeds", "100-119")
    units, command = sorted(figures["rows"], key=lambda row: row["by"], reverse=True)  # type: ignore[call-overload]
    assert (units["by"], command["by"]) == ("units", "command")
    assert units["error"] <= 1.35 * command["error"]
    assert _failures(units) == _failures(command) == 0


@pytest.mark.slow
def test_an_operator_brings_cassie_over_courses_that_it_cannot_cross_alone() -> None:
    figures = _figures("evaluate", "cassie", "--experiment", "parkour", "--seeds", "120-139")
    rows = {row["condition"]: row for row in figures["conditions"]}  # type: ignore[attr-defined]
    assert rows["alone"]["crossed"] == 0
    assert rows["with an operator"]["crossed"] >= 15
    assert rows["with an operator"]["involvement"] <= 0.05
    for row in figures["passages"]:  # type: ignore[attr-defined]
        assert row["condition"] != "alone" or row["passed"] == 0, row


@pytest.mark.slow
def test_an_operator_takes_the_a1_farther_than_it_comes_alone() -> None:
    figures = _figures("evaluate", "a1", "--experiment", "forest", "--seeds", "100-119")
    rows = {row["condition"]: row for row in figures["conditions"]}  # type: ignore[attr-defined]
    alone, driven = rows["state alone"], rows["state with an operator"]
    ratios = {(row["condition"], row["baseline"]): row for row in figures["ratios"]}  # type: ignore[attr-defined]
    for baseline in ("state alone", "state with a placebo"):
        assert ratios["state with an operator", baseline]["distance"]["low"] > 1.0
    assert driven["collisions"]["mean"] < alone["collisions"]["mean"]
    assert rows["state + vision"]["distance"]["mean"] >= 2.6 * alone["distance"]["mean"]
