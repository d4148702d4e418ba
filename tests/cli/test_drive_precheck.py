"""When the screen need not wait for the simulation, and what its process does without."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from pdtui.cli.options.shared_options import build_drive_config
from pdtui.cli.screen.drive_precheck import is_certain_to_start
from pdtui.driving.drive_config import DriveConfig
from pdtui.robots.robot_registry import find_needed_package, find_own_robots
from pdtui.stimulation.stimulation_map import StimulationMap


@pytest.mark.parametrize("robot", ["walker", "ant", "anymal", "cassie"])
def test_a_robot_with_its_own_map_and_policy_is_certain(robot: str, tmp_path: Path) -> None:
    config = build_drive_config(robot, None, "")
    assert is_certain_to_start(config)
    assert is_certain_to_start(replace(config, recording=str(tmp_path / "new" / "a.rrd")))


def test_what_may_still_be_refused_is_not_certain(
    small_map: StimulationMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = DriveConfig("ant", small_map, 0)
    assert is_certain_to_start(config)
    (tmp_path / "blocked").write_text("a file where a folder should be")
    (tmp_path / "there.rrd").write_text("a session")
    refused = {
        "a start": replace(config, start="upside down"),
        "another's weights": replace(config, policy="walker", force=True),
        "another policy": replace(config, policy="ant"),
        "no policy": replace(config, policy="nobody"),
        "another's world": replace(config, robot="CartPole-v1"),
        "options": replace(config, stimulation_map=replace(small_map, robot_options={"forward": "x"})),
        "a blocked folder": replace(config, recording=str(tmp_path / "blocked" / "a.rrd")),
        "a session that is there": replace(config, recording=str(tmp_path / "there.rrd")),
    }
    assert [why for why, one in refused.items() if is_certain_to_start(one)] == []
    assert is_certain_to_start(replace(config, policy="ant", force=True))


def test_robots_name_the_package_that_may_be_missing() -> None:
    needed = {name: find_needed_package(name) for name in find_own_robots()}
    assert needed["a1"] == needed["a1-vision"] == "pybullet"
    assert needed["metadrive"] == "metadrive"
    assert needed["ant"] == ""


def test_the_screens_process_loads_no_heavy_library() -> None:
    code = (
        "import sys\n"
        "from pdtui.cli.options.shared_options import build_drive_config\n"
        "from pdtui.cli.screen.drive_precheck import is_certain_to_start\n"
        "assert is_certain_to_start(build_drive_config('walker', None, ''))\n"
        "import pdtui.cli.screen.show_drive, pdtui.tui.drive_app, pdtui.driving.drive_client\n"
        "import pdtui.search.gains.gain_tuning_process\n"
        "heavy = ('torch', 'mujoco', 'gymnasium', 'rerun', 'scipy', 'pyarrow', 'pandas', 'matplotlib')\n"
        "print([name for name in heavy if name in sys.modules])"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
