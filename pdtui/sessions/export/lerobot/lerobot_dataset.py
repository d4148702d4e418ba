"""Writes a session as a LeRobot dataset, version 3.0 of its layout.

The layout is that of `lerobot.datasets` 0.4: the rows of all episodes in ``data``, and in ``meta`` what they
are, where each episode is, the tasks, and statistics.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from numpy.typing import NDArray

from pdtui.core.errors import SessionError
from pdtui.sessions.export.export_writer import ReplayObservations
from pdtui.sessions.export.lerobot.lerobot_episodes import (
    LerobotEpisode,
    list_features,
    read_lerobot_episodes,
)
from pdtui.sessions.export.lerobot.lerobot_features import (
    LerobotFeature,
    Statistics,
    combine_statistics,
    describe_rows,
)
from pdtui.sessions.session_header import SessionHeader, read_session_header

VERSION = "v3.0"
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_DATA = f"data/{_FILE}.parquet"
_EPISODES = f"meta/episodes/{_FILE}.parquet"
_INDICES = {
    "timestamp": LerobotFeature("float32"),
    **{name: LerobotFeature("int64") for name in ("frame_index", "episode_index", "index", "task_index")},
}


def export_lerobot_dataset(
    path: Path, output: Path, *, overwrite: bool = False, observe: ReplayObservations | None = None
) -> tuple[int, int]:
    """Write a session as a LeRobot dataset into a folder.

    A step's action, reward and end are those of the step; ``observation.state`` is what the policy observed
    before it, ``next.attributes`` are the kinematic attributes after it, and the task is what was latched.

    Args:
        path: the session.
        output: the folder.
        overwrite: whether an existing dataset is replaced.
        observe: computes the observations, which a session does not contain; without it, they are left out.

    Returns:
        The numbers of episodes and of control steps.

    Raises:
        SessionError: the session cannot be read or has no steps, or the output cannot be written.
    """
    if output.exists() and not (overwrite and (output / "meta" / "info.json").is_file()):
        raise SessionError(f"{output}: already exists; --overwrite replaces it if it is a LeRobot dataset")
    header = read_session_header(path)
    if header.steps == 0:
        raise SessionError(f"{path}: no control step is recorded, so there is nothing to export")
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(mkdtemp(prefix=f".{output.name}-", dir=output.parent))
        try:
            counts = _write_dataset(partial, header, observe)
            if output.exists():
                shutil.rmtree(output)
            partial.chmod(0o755)
            partial.rename(output)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
    except (OSError, pa.ArrowException) as error:
        raise SessionError(f"{output}: cannot be written: {error}") from error
    return counts


def _write_dataset(
    folder: Path, header: SessionHeader, observe: ReplayObservations | None
) -> tuple[int, int]:
    observations = None if observe is None else _collect_observations(observe, header)
    size = 0 if observations is None else len(next(iter(observations.values())))
    tasks: dict[str, int] = {}
    entries: list[dict[str, Any]] = []
    statistics: list[Statistics] = []
    features: dict[str, LerobotFeature] = {}
    writer: pa.parquet.ParquetWriter | None = None
    first = 0
    for number, episode in enumerate(read_lerobot_episodes(header, observations)):
        actions = episode.rows["action"]
        features = {
            **list_features(header, size),
            "action": LerobotFeature("float32", int(actions[0].size)),
            **_INDICES,
        }
        rows = {**episode.rows, **_number_rows(episode, number, first, tasks, header.info.dt)}
        table = pa.table({name: feature.to_arrow(rows[name]) for name, feature in features.items()})
        if writer is None:
            (folder / _place(_DATA)).parent.mkdir(parents=True)
            writer = pa.parquet.ParquetWriter(folder / _place(_DATA), table.schema)
        writer.write_table(table)
        statistics.append(describe_rows({name: rows[name] for name in features}))
        entries.append(_describe_episode(episode, number, first))
        first += len(episode)
    assert writer is not None
    writer.close()
    _write_meta(folder, header, features, tasks, entries, statistics)
    return len(entries), first


def _collect_observations(observe: ReplayObservations, header: SessionHeader) -> dict[int, NDArray[Any]]:
    return {
        int(step): np.asarray(row, np.float32).reshape(-1)
        for steps, block in observe(header)
        for step, row in zip(steps, block, strict=True)
    }


def _number_rows(
    episode: LerobotEpisode, number: int, first: int, tasks: dict[str, int], dt: float
) -> dict[str, NDArray[Any]]:
    count = np.arange(len(episode))
    return {
        "timestamp": (count * dt).astype(np.float32),
        "frame_index": count,
        "episode_index": np.full(len(episode), number),
        "index": first + count,
        "task_index": np.array([tasks.setdefault(task, len(tasks)) for task in episode.tasks]),
    }


def _describe_episode(episode: LerobotEpisode, number: int, first: int) -> dict[str, Any]:
    return {
        "episode_index": number,
        "tasks": list(dict.fromkeys(episode.tasks)),
        "length": len(episode),
        "data/chunk_index": 0,
        "data/file_index": 0,
        "dataset_from_index": first,
        "dataset_to_index": first + len(episode),
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }


def _write_meta(
    folder: Path,
    header: SessionHeader,
    features: dict[str, LerobotFeature],
    tasks: dict[str, int],
    entries: list[dict[str, Any]],
    statistics: list[Statistics],
) -> None:
    rate = 1.0 / header.info.dt
    info = {
        "codebase_version": VERSION,
        "robot_type": header.info.robot,
        "total_episodes": len(entries),
        "total_frames": sum(entry["length"] for entry in entries),
        "total_tasks": len(tasks),
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": round(rate) if abs(rate - round(rate)) < 1e-9 else rate,
        "splits": {"train": f"0:{len(entries)}"},
        "data_path": _DATA,
        "video_path": None,
        "features": {name: feature.as_dict() for name, feature in features.items()},
    }
    flat = [dict(_flatten_statistics(one)) for one in statistics]
    rows = [{**entry, **stats} for entry, stats in zip(entries, flat, strict=True)]
    (folder / _place(_EPISODES)).parent.mkdir(parents=True)
    pa.parquet.write_table(pa.Table.from_pylist(rows), folder / _place(_EPISODES))
    pa.parquet.write_table(_task_table(tasks), folder / "meta" / "tasks.parquet")
    (folder / "meta" / "info.json").write_text(json.dumps(info, indent=4), encoding="utf-8")
    whole = json.dumps(combine_statistics(statistics), indent=4)
    (folder / "meta" / "stats.json").write_text(whole, encoding="utf-8")


def _flatten_statistics(statistics: Statistics) -> Iterator[tuple[str, list[Any]]]:
    for name, values in statistics.items():
        for key, value in values.items():
            yield f"stats/{name}/{key}", value


def _task_table(tasks: dict[str, int]) -> pa.Table:
    """Return the tasks as the format wants them: a data frame whose index, without a name, is their text."""
    index = "__index_level_0__"
    described = {
        "index_columns": [index],
        "column_indexes": [],
        "columns": [
            _describe_column("task_index", "task_index", "int64"),
            _describe_column(None, index, "unicode"),
        ],
    }
    table = pa.table({"task_index": pa.array(tasks.values(), pa.int64()), index: pa.array(tasks, pa.utf8())})
    return table.replace_schema_metadata({"pandas": json.dumps(described)})


def _describe_column(name: str | None, field: str, kind: str) -> dict[str, Any]:
    numpy_kind = "object" if kind == "unicode" else kind
    return {
        "name": name,
        "field_name": field,
        "pandas_type": kind,
        "numpy_type": numpy_kind,
        "metadata": None,
    }


def _place(pattern: str) -> str:
    return pattern.format(chunk_index=0, file_index=0)
