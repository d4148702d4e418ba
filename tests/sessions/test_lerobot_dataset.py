"""A session as a LeRobot dataset: the written layout against the published one, version 3.0.

The `lerobot` package (0.4.4) wants an older Rerun and an older PyTorch than pdtui, so that it cannot be
installed beside it. Where it is, `test_lerobot_reads_it_back` runs, too.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from click.testing import CliRunner

import pdtui
from pdtui.cli import main
from pdtui.core.errors import SessionError
from pdtui.sessions.export.lerobot.lerobot_dataset import export_lerobot_dataset

STEPS, KEYS = 150, {20: "x", 100: "backspace", 130: "r"}


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> tuple[pdtui.DriveArrays, Path, Path]:
    """A drive with a rewind and a reset, its session and its dataset."""
    folder = tmp_path_factory.mktemp("lerobot")
    session, dataset = folder / "drive.rrd", folder / "dataset"
    drive = pdtui.drive("ant", keys=KEYS, steps=STEPS, record=session)
    result = CliRunner(env={"COLUMNS": "200"}).invoke(
        main, ["sessions", "export", str(session), "--format", "lerobot", "-o", str(dataset)]
    )
    assert result.exit_code == 0, result.output
    assert f"3 episodes, {STEPS} control steps" in result.output
    return drive, session, dataset


def info_of(dataset: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((dataset / "meta" / "info.json").read_text())
    return found


def test_the_layout_is_that_of_version_3(exported: tuple[pdtui.DriveArrays, Path, Path]) -> None:
    _, _, dataset = exported
    info = info_of(dataset)
    assert (info["codebase_version"], info["robot_type"], info["fps"]) == ("v3.0", "ant", 20)
    assert (info["total_episodes"], info["total_frames"], info["splits"]) == (3, STEPS, {"train": "0:3"})
    data = dataset / info["data_path"].format(chunk_index=0, file_index=0)
    schema = pyarrow.parquet.read_schema(data)
    assert schema.names == list(info["features"])
    for name, feature in info["features"].items():
        kind = schema.field(name).type
        (size,) = feature["shape"]
        if size > 1:
            assert (kind.list_size, str(kind.value_type)) == (size, "float")
        else:
            assert str(kind) == {"float32": "float", "bool": "bool"}.get(feature["dtype"], feature["dtype"])
    assert {"action", "observation.state", "timestamp", "frame_index", "episode_index", "index"} < set(
        schema.names
    )


def test_the_rows_are_those_of_the_drive(exported: tuple[pdtui.DriveArrays, Path, Path]) -> None:
    drive, _, dataset = exported
    table = pyarrow.parquet.read_table(dataset / "data" / "chunk-000" / "file-000.parquet")
    columns = {name: np.array(table.column(name).to_pylist()) for name in table.column_names}
    assert np.array_equal(columns["action"].astype(np.float32), drive.actions)
    assert np.array_equal(columns["next.attributes"], drive.attributes.astype(np.float32))
    assert np.array_equal(columns["activations"].astype(np.float32), drive.activations)
    assert columns["observation.state"].shape == (STEPS, 27)
    assert columns["index"].tolist() == list(range(STEPS))
    # A rewind and a reset each begin another episode.
    assert columns["episode_index"].tolist() == [0] * 100 + [1] * 30 + [2] * 20
    assert columns["frame_index"][[0, 99, 100, 129, 130]].tolist() == [0, 99, 0, 29, 0]
    assert columns["timestamp"][49] == pytest.approx(49 * 0.05)


def test_tasks_are_what_was_latched(exported: tuple[pdtui.DriveArrays, Path, Path]) -> None:
    pandas = pytest.importorskip("pandas")
    _, _, dataset = exported
    tasks = pandas.read_parquet(dataset / "meta" / "tasks.parquet")
    assert list(tasks.index) == ["the policy acts alone", "stop"]
    assert list(tasks["task_index"]) == [0, 1]
    episodes = pyarrow.parquet.read_table(dataset / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert episodes[0]["tasks"] == ["the policy acts alone", "stop"]
    spans = [(one["dataset_from_index"], one["dataset_to_index"], one["length"]) for one in episodes]
    assert spans == [(0, 100, 100), (100, 130, 30), (130, 150, 20)]


def test_statistics_are_those_of_all_rows(exported: tuple[pdtui.DriveArrays, Path, Path]) -> None:
    drive, _, dataset = exported
    stats = json.loads((dataset / "meta" / "stats.json").read_text())
    assert stats["action"]["count"] == [STEPS]
    assert np.allclose(stats["action"]["mean"], drive.actions.mean(axis=0), atol=1e-6)
    assert np.allclose(stats["action"]["std"], drive.actions.std(axis=0), atol=1e-6)
    assert np.allclose(stats["next.reward"]["max"], drive.rewards.max(), atol=1e-5)


def test_only_a_dataset_is_replaced(exported: tuple[pdtui.DriveArrays, Path, Path], tmp_path: Path) -> None:
    _, session, _ = exported
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    for overwrite in (False, True):
        with pytest.raises(SessionError, match="mine: already exists"):
            export_lerobot_dataset(session, tmp_path / "mine", overwrite=overwrite)
    assert (tmp_path / "mine" / "letter.txt").read_text() == "dear"
    assert export_lerobot_dataset(session, tmp_path / "new") == (3, STEPS)
    assert "observation.state" not in info_of(tmp_path / "new")["features"]
    with pytest.raises(SessionError, match="new: already exists"):
        export_lerobot_dataset(session, tmp_path / "new")
    export_lerobot_dataset(session, tmp_path / "new", overwrite=True)


def test_lerobot_reads_it_back(exported: tuple[pdtui.DriveArrays, Path, Path]) -> None:
    lerobot = pytest.importorskip("lerobot.datasets.lerobot_dataset", reason="needs lerobot")
    drive, _, dataset = exported
    read = lerobot.LeRobotDataset("pdtui/drive", root=dataset)
    assert (read.num_episodes, len(read), read.fps) == (3, STEPS, 20)
    item = read[25]
    assert np.array_equal(item["action"].numpy(), drive.actions[25])
    assert item["task"] == "stop"
