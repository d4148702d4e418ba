"""What a recorder was given comes back bit for bit."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from pdtui.sessions.session_reader import read_activations, read_session
from tests.sessions.conftest import Recorded
from tests.sessions.recorded_drives import TEXT, make_loop, record_drive


def test_everything_of_every_step_comes_back(recorded: Recorded) -> None:
    path, loop, records = recorded
    session = read_session(path)
    assert session.info == loop.info
    assert session.info.map_text == TEXT
    assert session.steps == len(records) == 100
    assert session.digests.tolist() == [record.digest for record in records]
    assert session.attributes.tobytes() == np.stack([record.attributes for record in records]).tobytes()
    assert session.actions.tobytes() == np.stack([record.action for record in records]).tobytes()
    assert session.rewards.tolist() == [record.reward for record in records]
    assert session.costs.tolist() == [record.cost for record in records]
    assert session.episodes.tolist() == [record.episode for record in records]
    assert session.active == tuple(record.behaviors for record in records)
    assert session.stimulations == tuple(record.stimulation for record in records)
    assert session.natural == tuple(record.natural for record in records)
    assert session.endings == {record.step: record.ended for record in records if record.ended}
    assert session.outcome == "the operator quit"


def test_activations_come_back_as_float32(recorded: Recorded) -> None:
    path, _, records = recorded
    activations = read_activations(path)
    assert activations.dtype == np.float32
    assert activations.tobytes() == np.stack([record.activations for record in records]).tobytes()


def test_events_keep_their_order_and_their_bits(recorded: Recorded) -> None:
    path, _, records = recorded
    session = read_session(path)
    assert session.events == tuple(event for record in records for event in record.events)
    assert [event.kind for event in session.events if event.step == 12] == ["behavior", "target", "factor"]
    assert next(event.value for event in session.events if event.kind == "target") == 0.1 + 0.2


def test_behaviors_are_named_in_the_order_in_which_they_were_latched(recorded: Recorded) -> None:
    behaviors = read_session(recorded[0]).behaviors
    assert behaviors[3] == ()
    assert behaviors[4] == ("go",)
    assert behaviors[12] == ("go", "hold")
    assert behaviors[45] == ("turn",)
    assert behaviors[52] == ()


def test_the_events_alone_repeat_the_run(recorded: Recorded, weights: Path) -> None:
    session = read_session(recorded[0])
    loop = make_loop(weights, session.info.seed)
    digests = [
        loop.advance([event for event in session.events if event.step == step]).digest
        for step in range(session.steps)
    ]
    assert session.digests.tolist() == digests


@pytest.mark.parametrize("rows_per_write", [1, 3, 1000])
def test_batches_of_any_size_hold_the_same(
    rows_per_write: int, recorded: Recorded, weights: Path, tmp_path: Path
) -> None:
    path = tmp_path / "batches.rrd"
    record_drive(path, weights, rows_per_write=rows_per_write)
    session, usual = read_session(path), read_session(recorded[0])
    assert session.digests.tolist() == usual.digests.tolist()
    assert session.events == usual.events
    assert session.active == usual.active


def test_a_stochastic_drive_says_so(weights: Path, tmp_path: Path) -> None:
    record_drive(tmp_path / "noise.rrd", weights, 5, stochastic=True)
    assert read_session(tmp_path / "noise.rrd").info.stochastic


def test_versions_and_date_are_in_the_file(recorded: Recorded) -> None:
    session = read_session(recorded[0])
    assert {"python", "cpu", "blas", "mujoco", "torch", "numpy", "pdtui"} <= session.versions.keys()
    assert session.created.startswith("20")


def test_rerun_accepts_the_file(recorded: Recorded) -> None:
    rerun = Path(sys.executable).with_name("rerun")
    done = subprocess.run(
        [rerun, "rrd", "verify", recorded[0]], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr


def test_each_recording_has_an_application_of_its_own_with_its_layout(
    recorded: Recorded, weights: Path, tmp_path: Path
) -> None:
    """A viewer has one layout for all recordings of an application."""
    record_drive(tmp_path / "again.rrd", weights, steps=3)
    applications = []
    for path in (recorded[0], tmp_path / "again.rrd"):
        reader = RrdReader(path)
        (recording,) = reader.recordings()
        assert {layout.application_id for layout in reader.blueprints()} == {recording.application_id}
        applications.append(recording.application_id)
    assert applications[0] != applications[1]
    assert all(re.fullmatch(r"pdtui ant \d{4}-\d\d-\d\d [\d:]{8} \w{6}", name) for name in applications)


def test_columns_have_names_in_the_table_for_the_viewer(recorded: Recorded) -> None:
    path, loop, records = recorded
    chunks = [chunk for chunk in RrdReader(path).stream() if chunk.entity_path == "/view/table"]
    rows = [row for chunk in chunks for row in chunk.to_record_batch().to_pylist()]
    assert [row["step"] for row in rows] == [record.step for record in records]
    for column, one in enumerate(loop.robot.attributes):
        found = np.array([row[f"{one.name} ({one.unit})"][0] for row in rows], np.float32)
        assert np.array_equal(found, np.array([r.attributes[column] for r in records], np.float32))
    assert [row["action 2"] for row in rows] == [[np.float32(record.action[2])] for record in records]
    assert [row["reward"] for row in rows] == [[np.float32(record.reward)] for record in records]
    assert [row["episode"] for row in rows] == [[record.episode] for record in records]
    latched = [[", ".join(one.name for one in record.behaviors)] for record in records]
    assert [row["behaviors"] for row in rows] == latched
    assert any(", " in names for (names,) in latched)


def test_the_layout_at_the_end_adds_what_came_and_leaves_out_what_did_not(
    recorded: Recorded, weights: Path, tmp_path: Path
) -> None:
    assert len(RrdReader(recorded[0]).recordings()) == 1
    begun, ended = layouts(recorded[0])
    assert "/behaviors" in begun & ended
    assert "/view/activations" in ended
    record_drive(tmp_path / "idle.rrd", weights, steps=3)
    begun, ended = layouts(tmp_path / "idle.rrd")
    assert "/behaviors" in begun - ended


def layouts(path: Path) -> list[set[str]]:
    """Entities that the views of each embedded layout start from; the one with the heat map comes last."""
    reader = RrdReader(path)
    found = []
    for layout in reader.blueprints():
        batches = [chunk.to_record_batch() for chunk in reader.stream(store=layout)]
        views = [batch for batch in batches if "ViewBlueprint:space_origin" in batch.schema.names]
        found.append(
            {text for view in views for row in view["ViewBlueprint:space_origin"].to_pylist() for text in row}
        )
    return sorted(found, key=lambda origins: "/view/activations" in origins)


def test_poses_are_drawn_with_every_link(recorded: Recorded) -> None:
    path, loop, _ = recorded
    chunks = [chunk for chunk in RrdReader(path).stream() if chunk.entity_path == "/view/robot"]
    moving = [chunk.to_record_batch() for chunk in chunks if not chunk.is_static]
    counts = {len(row) for batch in moving for row in batch.column("Capsules3D:translations").to_pylist()}
    assert counts == {len(loop.robot.links)}
    assert sum(batch.num_rows for batch in moving) == 100
