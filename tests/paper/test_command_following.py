"""How closely commands are followed: asked through the loop, measured against what was drawn."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.core.errors import RobotError
from pdtui.driving.drive_config import DriveConfig
from pdtui.paper.command_following import evaluate_command_following
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map


def test_anymal_follows_what_a_seed_draws() -> None:
    result = CliRunner().invoke(
        main, ["evaluate", "anymal", "--experiment", "commands", "--seeds", "7-7", "--json"]
    )
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert [row["command"] for row in data["commands"]] == ["forward", "lateral", "yaw rate"]
    assert data["outcomes"] == {"fell": 0, "out of time": 1}
    for row, (low, high) in zip(data["commands"], ((-0.3, 1.4), (-0.3, 0.3), (-1.0, 1.0)), strict=True):
        assert low <= row["asked"][0] <= high
        assert 0 < row["bias"] <= row["error"] < 0.25
    asked = np.random.default_rng(7).uniform([-0.3, -0.3, -1.0], [1.4, 0.3, 1.0])
    np.testing.assert_allclose([row["asked"][0] for row in data["commands"]], asked)


def test_several_maps_make_one_json_document() -> None:
    line = ["evaluate", "anymal", "anymal", "--experiment", "commands", "--seeds", "7", "--json"]
    result = CliRunner().invoke(main, line)
    assert result.exit_code == 0, result.output
    first, second = json.loads(result.output)
    assert first == second
    assert first["robot"] == "anymal"


def test_a_robot_without_commands_is_refused() -> None:
    with pytest.raises(RobotError, match="walker: it takes no commands"):
        evaluate_command_following(DriveConfig("walker", load_map(find_map("walker")), 0), [1])
