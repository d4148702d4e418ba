"""Activations as they are, as float16, and not recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from pdtui.core.errors import SessionError
from pdtui.sessions.comparison.session_comparison import compare_sessions
from pdtui.sessions.export.export_writer import export_stream
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import read_activations, read_session
from pdtui.sessions.session_repair import repair_session
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.streams.step_block_reader import read_step_blocks
from pdtui.sessions.writer import step_record_columns
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded


def record(recorded: Recorded, path: Path, kept: ActivationsKept) -> Path:
    _, loop, records = recorded
    with SessionRecorder(path, replace(loop.info, activations=kept)) as recorder:
        for one in records:
            recorder.write(one)
        recorder.close("the operator quit")
    return path


def test_half_is_rounded_and_off_is_refused_by_name(recorded: Recorded, tmp_path: Path) -> None:
    whole, _, records = recorded
    half = record(recorded, tmp_path / "half.rrd", "half")
    off = record(recorded, tmp_path / "off.rrd", "off")
    exact = np.stack([one.activations for one in records])
    kept = read_activations(half)
    assert kept.dtype == np.float32
    np.testing.assert_array_equal(kept, exact.astype(np.float16).astype(np.float32))
    with pytest.raises(SessionError, match=r"off\.rrd: the activations were not recorded"):
        read_activations(off)
    with pytest.raises(SessionError, match=r"off\.rrd: the activations were not recorded"):
        export_stream(off, "activations", tmp_path / "a.parquet")
    assert export_stream(half, "activations", tmp_path / "a.parquet") == len(records)
    assert off.stat().st_size < half.stat().st_size < whole.stat().st_size


@pytest.mark.parametrize("kept", ["half", "off"])
def test_everything_else_is_there(kept: ActivationsKept, recorded: Recorded, tmp_path: Path) -> None:
    path = record(recorded, tmp_path / "a.rrd", kept)
    session = read_session(path)
    assert session.info.activations == kept
    result = compare_sessions(read_session(recorded[0]), session)
    assert (result.first_difference, result.steps, result.circumstances) == (None, len(recorded[2]), ())
    torn = tmp_path / "torn.rrd"
    torn.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    assert repair_session(torn, torn).header.info.activations == kept
    assert examine_session(torn).whole


def test_a_column_has_one_type_in_all_sessions(recorded: Recorded, tmp_path: Path) -> None:
    """Rerun's viewer and catalog refuse recordings together whose columns of one name differ in type."""
    types: dict[tuple[str, str], str] = {}
    for path in (recorded[0], record(recorded, tmp_path / "half.rrd", "half")):
        for chunk in RrdReader(path).stream():
            for field in chunk.to_record_batch().schema:
                column = chunk.entity_path, field.name
                assert types.setdefault(column, str(field.type)) == str(field.type), column
    assert ("/drive", "activations_float16") in types


def test_a_session_of_an_earlier_version_has_both_kinds_in_one_column(
    recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(step_record_columns, "HALF_ACTIVATIONS", "activations")
    path = record(recorded, tmp_path / "old.rrd", "half")
    monkeypatch.undo()
    expected = np.stack([one.activations for one in recorded[2]]).astype(np.float16)
    np.testing.assert_array_equal(read_activations(path), expected.astype(np.float32))
    blocks = read_step_blocks(read_session(path), activations=True)
    assert sum(len(block.activations) for block in blocks if block.activations is not None) == len(expected)


def test_beyond_the_range_of_half_is_infinite(recorded: Recorded, tmp_path: Path) -> None:
    _, loop, records = recorded
    large = records[0]._replace(activations=np.full_like(records[0].activations, 1e6))
    with SessionRecorder(tmp_path / "a.rrd", replace(loop.info, activations="half")) as recorder:
        recorder.write(large)
    assert np.isinf(read_activations(tmp_path / "a.rrd")).all()
