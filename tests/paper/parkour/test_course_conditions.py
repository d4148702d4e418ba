"""The parkour experiment: what the policy does alone and with an operator, and the score of a drive."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.errors import PdtuiError, SessionError
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.paper.parkour.course_conditions import evaluate_parkour
from pdtui.paper.parkour.course_drive import drive_through_course, read_course_score
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map


@pytest.fixture(scope="module")
def config() -> DriveConfig:
    return DriveConfig("cassie", load_map(find_map("cassie")), 0, activations="off")


def test_a_drive_with_the_operator_scores_as_its_recording_does(config: DriveConfig, tmp_path: Path) -> None:
    result = evaluate_parkour(
        config, [1000], conditions=["operator"], steps=260, record=tmp_path, workers=1, obstacles=()
    )
    (row,) = result.conditions
    (path,) = tmp_path.glob("*.rrd")
    assert path.with_suffix(".keys").is_file()
    scored, policy = read_course_score(path, "cassie", 260)
    assert (scored, policy) == (row.runs[0], "cassie")
    assert scored.keys  # the first obstacle is nearer than it walks in that time
    assert not scored.crossed
    with pytest.raises(SessionError, match="already exists"):
        evaluate_parkour(config, [1000], conditions=["operator"], record=tmp_path)
    again = evaluate_parkour(config, [], conditions=[], sessions=[path], steps=260)
    assert [one.runs for one in again.conditions] == [(scored,)]


def test_alone_it_runs_into_the_first_obstacle_and_the_operator_passes_it(config: DriveConfig) -> None:
    result = evaluate_parkour(config, [1001], steps=1, workers=1, obstacles=["opening door"])
    passed = {one.condition: (one.passed, one.attempts) for one in result.passages}
    assert passed == {"alone": (0, 1), "with an operator": (1, 1)}


def test_a_drive_elsewhere_is_not_scored(config: DriveConfig, tmp_path: Path) -> None:
    loop, path = build_control_loop(config), tmp_path / "plane.rrd"
    with SessionRecorder(path, loop.info) as recorder:
        recorder.write(loop.advance())
    with pytest.raises(SessionError, match="with start 'parkour', found one of cassie with the usual start"):
        read_course_score(path, "cassie", 100)
    with pytest.raises(PdtuiError, match="expected a robot on a parkour course"):
        drive_through_course(loop, 1)


def test_conditions_that_it_does_not_have_are_named(config: DriveConfig) -> None:
    with pytest.raises(PdtuiError, match="the conditions alone, operator, found vision"):
        evaluate_parkour(config, [1000], conditions=["vision"])  # type: ignore[list-item]
