"""Obstacles in a session, and what is counted of an episode: live, and read from the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.snapshot_builder import SnapshotBuilder
from pdtui.sessions.episode_statistics import EpisodeStatistics, EpisodeStatisticsCounter
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.session_repair import repair_session
from pdtui.sessions.session_summary import summarize_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.obstacle_course import course_loop
from tests.real_viewer import RealViewer

EVENTS = {
    4: [DriveEvent(4, "behavior", "push", key="w")],
    12: [DriveEvent(12, "reset", key="r")],
    15: [DriveEvent(15, "behavior", "push", key="w"), DriveEvent(15, "default", key="space")],
    18: [DriveEvent(18, "rewind", value=10.0, key="backspace")],
}
STEPS = 24
Course = tuple[Path, list[Floats], list[EpisodeStatistics]]


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Course:
    """A drive with a reset and a rewind before it; obstacles and the screen's tally after each step."""
    path = tmp_path_factory.mktemp("course") / "course.rrd"
    loop = course_loop()
    observer, obstacles, tallies = SnapshotBuilder(loop), [], []
    with SessionRecorder(path, loop.info, rows_per_write=5) as recorder:
        for step in range(STEPS):
            record = loop.advance(EVENTS.get(step, []))
            recorder.write(record)
            observer.add_step(record)
            snapshot = observer.build_snapshot(
                paused=False, speed=1.0, achieved_speed=1.0, recorded_bytes=0, finished=""
            )
            tallies.append(snapshot.statistics)
            obstacles.append(record.scenery.cylinders)
            assert (snapshot.scenery is not None) == (step in (0, 12, 18)), step
            if snapshot.scenery is not None:
                assert snapshot.scenery is record.scenery
    return path, obstacles, tallies


def drawn(path: Path, entity: str, component: str) -> dict[int, np.ndarray]:
    """Values of a component by the step at which they were written."""
    found = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and not chunk.is_static and component in batch.schema.names:
            for step, value in zip(batch.column("step"), batch.column(component), strict=True):
                found[step.as_py()] = np.array(value.as_py())
    return found


def test_the_viewer_gets_them_once_a_world(course: Course) -> None:
    path, obstacles, _ = course
    centers = drawn(path, "/view/obstacles", "Cylinders3D:centers")
    discs = drawn(path, "/view/obstacles_above", "Points2D:positions")
    radii = drawn(path, "/view/obstacles_above", "Points2D:radii")
    assert list(centers) == list(discs) == [0, 12, 18]
    assert not np.array_equal(obstacles[0], obstacles[12])
    for step, found in centers.items():
        np.testing.assert_allclose(found[:, :2], obstacles[step][:, :2], rtol=1e-6)
        np.testing.assert_allclose(discs[step], obstacles[step][:, :2] * [1.0, -1.0], rtol=1e-6)
        np.testing.assert_allclose(radii[step], obstacles[step][:, 2], rtol=1e-6)


def test_a_session_counts_what_the_screen_counted(course: Course) -> None:
    path, obstacles, live = course
    session = read_session(path)
    assert session.info.obstacles
    summary = summarize_session(session)
    assert summary.tallies == (live[-1], live[17])
    before, after = summary.tallies
    # Steps 0 to 11 reached 3 m; the rewind to step 10 went on from 2.5 m, for 6 steps.
    assert (before.episode, before.steps, before.involvement, before.distance) == (0, 18, 2, 4.0)
    assert (after.episode, after.steps, after.involvement, after.distance) == (1, 6, 2, 1.5)
    hit = [int((obstacles[step][:, 0] <= reached).sum()) for step, reached in ((0, 3.0), (0, 4.0), (0, 2.5))]
    assert before.collisions == hit[0] + hit[1] - hit[2] > 0
    assert summary.total_cost == (before.collisions or 0) + (after.collisions or 0)


def test_a_repaired_session_has_them(course: Course, tmp_path: Path) -> None:
    path, _, _ = course
    torn, output = tmp_path / "torn.rrd", tmp_path / "whole.rrd"
    torn.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    steps = repair_session(torn, output).steps
    assert read_session(output).info.obstacles
    there = [step for step in (0, 12, 18) if step < steps]
    assert there
    assert list(drawn(output, "/view/obstacles", "Cylinders3D:centers")) == there


def test_what_a_robot_has_not_is_not_counted() -> None:
    info = course_loop().info
    tallies = EpisodeStatisticsCounter(replace(info, obstacles=False, attributes=info.attributes[:1]))
    tallies.add(2**62, involved=True, cost=3.0, attributes=np.zeros(1))
    (tally,) = tallies.all
    assert (tally.steps, tally.share, tally.distance, tally.collisions) == (1, 1.0, None, None)
    assert EpisodeStatisticsCounter(info).of(4) == EpisodeStatistics(4, 0, 0, 0.0, 0.0)


@pytest.mark.viewer
def test_the_viewer_shows_them(viewer: RealViewer, course: Course) -> None:
    path, _, _ = course
    viewer.show(path)
    picture = viewer.picture("obstacles", step=3).astype(int)
    green = (picture[..., 1] > picture[..., 0] + 20) & (picture[..., 1] > picture[..., 2] + 20)
    left = green[:, : picture.shape[1] * 2 // 5]
    assert left[: len(left) // 2].sum() > 500  # trunks
    assert left[len(left) // 2 :].sum() > 20  # discs
