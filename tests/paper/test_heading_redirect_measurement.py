"""Redirects: a right angle and back, counted as done only where the robot heads there."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.core.errors import MapError
from pdtui.driving.drive_config import DriveConfig
from pdtui.paper.heading_redirect_measurement import measure_heading_redirects
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map

SEED = 1800


def test_cassie_is_redirected_to_either_side_and_back() -> None:
    line = ["evaluate", "cassie", "--experiment", "redirect", "--seeds", str(SEED), "--json"]
    result = CliRunner(env={"COLUMNS": "120"}).invoke(main, line)
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert data["behavior"] == "hold heading"
    assert [one["side"] for one in data["drives"]] == ["left", "right"]
    for one in data["drives"]:
        assert one["done"]
        assert one["outcome"] is None
        assert 0.0 < max(one["there"], one["back"]) <= 0.3


def test_a_map_that_holds_no_heading_is_refused() -> None:
    config = DriveConfig("walker", load_map(find_map("walker")), 0)
    with pytest.raises(MapError, match="no behavior of mode pid holds 'yaw'"):
        measure_heading_redirects(config, [1600])
