"""Where messages end: cuts are found at every byte."""

from __future__ import annotations

from pathlib import Path

from pdtui.sessions.rrd.message_framing import undamaged_length
from tests.sessions.conftest import Recorded


def test_a_cut_file_ends_with_its_last_whole_message(recorded: Recorded, tmp_path: Path) -> None:
    data = recorded[0].read_bytes()
    path, ends = tmp_path / "cut.rrd", set()
    for size in (*range(0, len(data), len(data) // 50), len(data) - 33, len(data) - 1):
        path.write_bytes(data[:size])
        length = undamaged_length(path)
        assert length <= size
        ends.add(length)
        path.write_bytes(data[:length])
        assert undamaged_length(path) == length
    assert len(ends) > 20
    path.write_bytes(data + b"more")
    assert undamaged_length(path) < len(data)
