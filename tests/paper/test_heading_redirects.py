"""Redirects: a right angle and back, counted as done only where the robot heads there."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner

import pdtui
from pdtui.cli import main
from pdtui.core.errors import MapError
from pdtui.driving.drive_config import DriveConfig
from pdtui.paper.heading_redirects import measure_heading_redirects
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map

SEED = 1601


def test_cassie_is_redirected_to_either_side_and_back() -> None:
    line = ["evaluate", "cassie", "--experiment", "redirect", "--seeds", str(SEED), "--json"]
    result = CliRunner(env={"COLUMNS": "120"}).invoke(main, line)
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert data["behavior"] == "hold heading"
    assert [one["side"] for one in data["drives"]] == ["left", "right"]
    # The same drive by keys: 15° for each press of an arrow.
    keys = {100: "h"} | {101 + n: "left" for n in range(6)} | {500 + n: "right" for n in range(6)}
    drive = pdtui.drive("cassie", keys=keys, steps=900, seed=SEED)
    off = math.remainder(drive["yaw"][400:500].mean() - drive["yaw"][99] - math.pi / 2, 2 * math.pi)
    assert data["drives"][0]["there"] == pytest.approx(abs(off), abs=0.05)
    for one in data["drives"]:
        assert one["done"] == (one["outcome"] is None and max(one["there"], one["back"]) <= 0.3)


def test_a_map_that_holds_no_heading_is_refused() -> None:
    config = DriveConfig("walker", load_map(find_map("walker")), 0)
    with pytest.raises(MapError, match="no behavior of mode pid holds 'yaw'"):
        measure_heading_redirects(config, [1600])
