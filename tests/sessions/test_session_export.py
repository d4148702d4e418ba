"""Exported tables say what their columns are, and hold what was recorded, in every format."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

import pdtui
from pdtui.cli import main
from pdtui.core.errors import SessionError
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.geometry import compute_link_poses
from pdtui.sessions.export.export_streams import STREAMS
from pdtui.sessions.export.export_writer import export_all_streams, export_stream
from pdtui.sessions.session_reader import read_activations, read_session
from tests.sessions.conftest import Recorded


def test_fields_say_their_units_and_the_table_its_session(recorded: Recorded, tmp_path: Path) -> None:
    path, loop, _ = recorded
    export_stream(path, "attributes", tmp_path / "a.parquet")
    schema = pyarrow.parquet.read_schema(tmp_path / "a.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert (units["step"], units["time"]) == ("control steps", "s")
    assert {units[f"{one.name} ({one.unit})"] == one.unit for one in loop.robot.attributes} == {True}
    assert schema.field("yaw (rad)").metadata[b"description"].decode() == "angle that jumps at ±π"
    assert schema.metadata[b"robot"] == b"ant"
    assert schema.metadata[b"seed"] == b"5"
    assert schema.metadata[b"policy_sha256"].decode() == loop.policy.sha256
    assert float(schema.metadata[b"seconds_per_step"]) == loop.robot.control_dt


def test_what_is_not_there_is_null(recorded: Recorded, tmp_path: Path) -> None:
    path, _, records = recorded
    export_stream(path, "gains", tmp_path / "g.parquet")
    ended = pyarrow.parquet.read_table(tmp_path / "g.parquet").column("ended").to_pylist()
    assert ended == [record.ended or None for record in records]
    export_stream(path, "events", tmp_path / "e.parquet")
    events = pyarrow.parquet.read_table(tmp_path / "e.parquet").to_pylist()
    target, rewind, reset = (
        next(row for row in events if row["kind"] == kind) for kind in ("target", "rewind", "reset")
    )
    assert (target["name"], target["value"], target["key"]) == ("hold", 0.1 + 0.2, "up")
    assert (rewind["name"], rewind["value"]) == (None, 10.0)
    assert (reset["name"], reset["value"], reset["key"]) == (None, None, None)
    export_stream(path, "events", tmp_path / "e.csv")
    assert (tmp_path / "e.csv").read_text().splitlines()[-1].endswith('"reset",,,')


def test_poses_are_those_of_the_links(recorded: Recorded, tmp_path: Path) -> None:
    path, loop, records = recorded
    export_stream(path, "poses", tmp_path / "p.parquet")
    rows = pyarrow.parquet.read_table(tmp_path / "p.parquet").to_pydict()
    links = loop.robot.links
    assert len(rows["step"]) == len(records) * len(links)
    expected = compute_link_poses(links, np.array([record.poses for record in records])).reshape(-1, 7)
    exported = np.stack([rows[name] for name in ("x", "y", "z", "qw", "qx", "qy", "qz")], axis=1)
    np.testing.assert_allclose(exported, expected, atol=1e-5)
    assert rows["link"][: len(links)] == [link.name for link in links]
    assert rows["step"][len(links)] == 1


@pytest.fixture(scope="module")
def driven(map_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session that can be replayed."""
    path = tmp_path_factory.mktemp("driven") / "driven.rrd"
    pdtui.drive("ant", map_path, keys={10: "w", 30: "r"}, steps=60, record=path)
    return path


def test_observations_are_computed_again(driven: Path, policy: Policy, tmp_path: Path) -> None:
    table = tmp_path / "o.parquet"
    line = ["sessions", "export", str(driven), "--stream", "observations", "-o", str(table)]
    done = CliRunner().invoke(main, line)
    assert done.exit_code == 0, done.output
    assert done.output == f"wrote {table}: 60 rows\n"
    rows = pyarrow.parquet.read_table(table)
    assert rows.column_names[2:] == [f"observation {row}" for row in range(27)]
    observed = np.stack([rows.column(name).to_numpy() for name in rows.column_names[2:]], axis=1)
    session, recorded = read_session(driven), read_activations(driven)
    for step in (0, 10, 31, 59):
        acted = policy.act(observed[step], session.stimulations[step])
        np.testing.assert_array_equal(acted.activations, recorded[step])
    with pytest.raises(SessionError, match="the observations are not recorded; a replay computes them"):
        export_stream(driven, "observations", tmp_path / "none.parquet")


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_all_streams_are_a_folder_of_tables(form: str, driven: Path, tmp_path: Path) -> None:
    export = ["sessions", "export", str(driven), "--stream", "all"]
    line = [*export, "--format", form, "-o", str(tmp_path / "t")]
    done = CliRunner().invoke(main, line)
    assert done.exit_code == 0, done.output
    assert "attributes 60" in done.output
    assert {file.name for file in (tmp_path / "t").iterdir()} == {f"{name}.{form}" for name in STREAMS}
    again = CliRunner().invoke(main, line)
    assert again.exit_code == 1
    assert "already exists; --overwrite replaces it" in again.output


def test_an_mcap_file_is_read_back_by_its_library(recorded: Recorded, tmp_path: Path) -> None:
    path, loop, _ = recorded
    session = read_session(path)
    rows = export_all_streams(path, tmp_path / "a.mcap")
    assert set(rows) == STREAMS.keys() - {"observations"}
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file)
        counts: dict[str, int] = {}
        attributes, times = [], []
        for schema, channel, message in reader.iter_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            if channel.topic == "/attributes":
                assert schema is not None
                attributes.append(json.loads(message.data))
                times.append(message.log_time)
                described = json.loads(schema.data)["properties"]["vx (m/s)"]
        (metadata,) = reader.iter_metadata()
    assert counts == {f"/{name}": count for name, count in rows.items() if count}
    names = [f"{one.name} ({one.unit})" for one in loop.robot.attributes]
    assert [[row[name] for name in names] for row in attributes] == session.attributes.tolist()
    assert times == [round(step * session.info.dt * 1e9) for step in range(session.steps)]
    assert described == {
        "type": ["number", "null"],
        "unit": "m/s",
        "description": "kinematic attribute after the step",
    }
    assert metadata.metadata["robot"] == "ant"


def test_a_format_that_does_not_exist_is_named(recorded: Recorded, tmp_path: Path) -> None:
    with pytest.raises(SessionError, match=r"a\.txt: expected a name that ends with one of \.parquet, \.csv"):
        export_stream(recorded[0], "gains", tmp_path / "a.txt")
