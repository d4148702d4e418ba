"""Branches of a drive: what their files say, and how they are compared side by side."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from pdtui.cli import main
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.driving.control_loop import ControlLoop
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.sessions.drive_info import BranchOrigin, decode_drive_info, encode_drive_info
from pdtui.sessions.drive_path import compare_drive_paths, read_drive_path
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.stimulation_map import StimulationMap

BRANCHED = 20


def record(
    path: Path, loop: ControlLoop, key: tuple[int, str], origin: BranchOrigin | None = None
) -> list[np.ndarray]:
    """Record 60 control steps with one key; return where the torso was after each."""
    places = []
    step, behavior = key
    with SessionRecorder(path, replace(loop.info, branch=origin)) as recorder:
        while loop.step < 60:
            events = [DriveEvent(step, "behavior", behavior, key="x")] if loop.step == step else []
            recorder.write(loop.advance(events))
            places.append(loop.robot.read_poses()[0, :3])
        recorder.close("finished")
    return places


@pytest.fixture(scope="module")
def sessions(
    tmp_path_factory: pytest.TempPathFactory, policy: Policy, small_map: StimulationMap
) -> tuple[Path, Path, list[np.ndarray], list[np.ndarray]]:
    """A drive and its branch at step 20, and where both robots were."""
    folder = tmp_path_factory.mktemp("branches")
    first, second = folder / "a.rrd", folder / "a-from-step-20.rrd"
    parent = record(first, ControlLoop(make_robot("ant"), policy, small_map, 3), (30, "push"))
    origin = BranchOrigin("a.rrd", read_session_header(first).created, BRANCHED)
    branch = record(second, ControlLoop(make_robot("ant"), policy, small_map, 3), (20, "twitch"), origin)
    return first, second, parent, branch


def run(*arguments: str | Path) -> Result:
    return CliRunner(env={"COLUMNS": "120"}).invoke(main, [str(argument) for argument in arguments])


def test_a_branch_says_where_it_branched_off(sessions: Sequence[Path]) -> None:
    origin = read_session_header(sessions[1]).info.branch
    assert origin is not None
    assert (origin.session, origin.step) == ("a.rrd", 20)
    assert read_session_header(sessions[0]).info.branch is None
    shown = run("sessions", "show", sessions[1]).output
    assert f"a.rrd of {origin.created}, at step 20" in " ".join(shown.split())
    assert json.loads(run("sessions", "show", sessions[1], "--json").output)["branch"]["step"] == 20


def test_branches_are_compared_side_by_side(
    sessions: tuple[Path, Path, list[np.ndarray], list[np.ndarray]], tmp_path: Path
) -> None:
    first, second, parent, branch = sessions
    figure = tmp_path / "both.png"
    result = run("sessions", "compare", first, second, "--figure", figure)
    assert result.exit_code == 3
    assert result.output.startswith("differ from step 20 of 60 on")
    assert "the second branched off the first at step 20" in result.output
    assert figure.read_bytes().startswith(b"\x89PNG")
    data = json.loads(run("sessions", "compare", first, second, "--json").output)
    assert [row["step"] for row in (data["paths"][0], data["paths"][-1])] == [20, 59]
    for row in data["paths"]:
        one, other = parent[row["step"]], branch[row["step"]]
        assert row["first"] == pytest.approx(one[:2], abs=1e-5)
        assert row["second"] == pytest.approx(other[:2], abs=1e-5)
        assert row["apart"] == pytest.approx(np.hypot(*(one - other)[:2]), abs=1e-5)
    assert run("sessions", "compare", second, second).exit_code == 0
    again = run("sessions", "compare", first, second, "--figure", figure)
    assert (again.exit_code, "already exists" in again.output) == (1, True)


def test_courses_are_compared_where_both_have_poses(sessions: Sequence[Path]) -> None:
    course = read_drive_path(read_session_header(sessions[0]))
    assert len(course.steps) == len(course.attributes) == 60
    assert compare_drive_paths(course, course, 60) == ()
    bare = replace(course, pose_steps=course.pose_steps[:0], places=course.places[:0])
    assert compare_drive_paths(course, bare, 0) == ()


@pytest.mark.parametrize(
    "text",
    ["[", "{}", '{"session": "a", "created": "b", "step": -1}', '{"session": 1, "created": "", "step": 2}'],
)
def test_an_origin_that_is_not_as_expected_is_refused(sessions: Sequence[Path], text: str) -> None:
    info = read_session_header(sessions[0]).info
    properties = {name: [value] for name, value in encode_drive_info(info, "").items()}
    properties["layers"] = list(info.layers)
    assert decode_drive_info({**properties, "branch": [""]})[0].branch is None
    with pytest.raises(SessionError, match="property 'branch': invalid"):
        decode_drive_info({**properties, "branch": [text]})
