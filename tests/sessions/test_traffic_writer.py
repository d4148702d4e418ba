"""Roads and traffic in a session, read back with Rerun's own reader, and in the real viewer."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from pdtui.core.drive_events import DriveEvent
from pdtui.core.scenery import Scenery, Traffic
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.real_viewer import RealViewer
from tests.small_road import APPEARS, VANISHES, small_road_loop

STEPS = 40
RESET, REWIND, RETURN = 14, 30, 36
EVENTS = {
    RESET: [DriveEvent(RESET, "reset", key="r")],
    REWIND: [DriveEvent(REWIND, "rewind", value=20.0, key="backspace")],
    RETURN: [DriveEvent(RETURN, "rewind", value=10.0, key="backspace")],
}
TRUCK = "/view/traffic/vehicle_2"
Road = tuple[Path, list[Scenery], list[Traffic]]


@pytest.fixture(scope="module")
def road(tmp_path_factory: pytest.TempPathFactory) -> Road:
    """A drive with a reset, a rewind to a step at which the truck was there, and one to the first episode."""
    path = tmp_path_factory.mktemp("road") / "road.rrd"
    loop = small_road_loop()
    scenery, traffic = [], []
    with SessionRecorder(path, loop.info, rows_per_write=4) as recorder:
        for step in range(STEPS):
            record = loop.advance(EVENTS.get(step, []))
            recorder.write(record)
            scenery.append(record.scenery)
            traffic.append(record.traffic)
    return path, scenery, traffic


def rows(path: Path, entity: str, component: str) -> dict[int, np.ndarray]:
    """Values of a component by the step at which they were written."""
    found = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and not chunk.is_static and component in batch.schema.names:
            for step, value in zip(batch.column("step"), batch.column(component), strict=True):
                found[step.as_py()] = np.array(value.as_py())
    return found


def latest(values: dict[int, np.ndarray], step: int) -> np.ndarray:
    """What the viewer shows at a step."""
    return values[max(one for one in values if one <= step)]


def is_there(traffic: Traffic) -> bool:
    return ("vehicle", 2) in traffic.keys


def test_a_box_is_there_exactly_while_the_robot_says_so(road: Road) -> None:
    path, _, traffic = road
    there = [is_there(one) for one in traffic]
    changes = [step for step, (before, now) in enumerate(pairwise([False, *there])) if before != now]
    # It comes and goes twice, as the world begins anew; the rewind leads back to before it went.
    assert changes == [
        APPEARS - 1,
        VANISHES - 1,
        RESET + APPEARS - 1,
        RESET + VANISHES - 1,
        REWIND,
        REWIND + 3,
    ]
    sizes = rows(path, TRUCK, "Boxes3D:half_sizes")
    assert {step: len(size) for step, size in sizes.items()} == {step: int(there[step]) for step in changes}
    for step in changes:
        for component in ("colors", "fill_mode"):
            assert len(rows(path, TRUCK, f"Boxes3D:{component}")[step]) == int(there[step])
    np.testing.assert_allclose(sizes[changes[0]], [[4.0, 1.25, 1.5]])


def test_a_box_is_where_the_robot_says_it_is(road: Road) -> None:
    path, _, traffic = road
    centers, turns = (rows(path, TRUCK, f"Boxes3D:{name}") for name in ("centers", "quaternions"))
    for step, now in enumerate(traffic):
        if is_there(now):
            pose = now.poses[now.keys.index(("vehicle", 2))]
            np.testing.assert_allclose(latest(centers, step), [pose[:3]], rtol=1e-6)
            (x, y, z, w) = latest(turns, step)[0]
            assert (x, y) == (0.0, 0.0)
            assert 2 * np.arctan2(z, w) == pytest.approx(pose[3], rel=1e-6)


def test_what_stands_still_is_written_once(road: Road) -> None:
    path, _, _ = road
    for entity in ("/view/traffic/vehicle_0", "/view/traffic/obstacle_1"):
        for component in ("half_sizes", "centers"):
            assert list(rows(path, entity, f"Boxes3D:{component}")) == [0]


def test_lines_are_written_once_a_world(road: Road) -> None:
    path, scenery, _ = road
    assert len({id(one) for one in scenery}) == 3, "the first rewind stays in its world"
    strips = rows_of_strips(path)
    assert list(strips) == [0, RESET, RETURN]
    for step, written in strips.items():
        pieces = [piece for line in scenery[step].lines for piece in line.painted_pieces()]
        assert len(written) == len(pieces)
        for one, piece in zip(written, pieces, strict=True):
            np.testing.assert_allclose(one, piece, rtol=1e-6)
    assert list(rows(path, "/view/obstacles", "Cylinders3D:centers")) == [0], "cones are the same"


def rows_of_strips(path: Path) -> dict[int, list[list[list[float]]]]:
    """Polylines, which differ in length, by the step at which they were written."""
    found = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == "/view/road_lines" and "LineStrips3D:strips" in batch.schema.names:
            for step, value in zip(batch.column("step"), batch.column("LineStrips3D:strips"), strict=True):
                found[step.as_py()] = value.as_py()
    return found


def test_a_session_on_a_road_says_so(road: Road) -> None:
    path, _, _ = road
    info = read_session(path).info
    assert (info.roads, info.obstacles) == (True, False)


@pytest.mark.viewer
def test_the_viewer_shows_the_truck_come_and_go(viewer: RealViewer, road: Road) -> None:
    path, _, _ = road
    viewer.show(path)
    assert "Road from above" in viewer.view_names()
    yellow = []
    for step in (APPEARS - 2, APPEARS, VANISHES):
        picture = viewer.picture(f"road-{step}", step=step).astype(int)
        left = picture[:, : picture.shape[1] * 2 // 5]
        above = left[len(left) // 2 :]
        warm = (above[..., 0] > above[..., 2] + 60) & (above[..., 1] > above[..., 2] + 40)
        yellow.append(int(warm.sum()))
    before, there, after = yellow
    assert before > 100, "a parked car"
    assert there > 2 * before
    assert after < 1.2 * before
