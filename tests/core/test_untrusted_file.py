"""Budgets of files, and files that are larger or none."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pdtui.core.untrusted_file import FILE_BUDGETS, describe_bytes, open_regular_file, read_bounded_file
from pdtui.guide import guide_pages


def test_the_guide_states_every_budget() -> None:
    page = (Path(guide_pages.__file__).parent / "sessions.md").read_text()
    for budget in FILE_BUDGETS:
        size, memory = describe_bytes(budget.bytes), describe_bytes(budget.memory)
        assert f"| {budget.kind} | {size} | {memory} | {budget.seconds:g} s |" in page


def test_files_that_are_too_large_or_none_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(bytes(2048))
    assert len(read_bounded_file(path, 2048)) == 2048
    with pytest.raises(OSError, match="expected at most 1 KiB, found more"):
        read_bounded_file(path, 1024)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="expected a regular file"):
        open_regular_file(tmp_path / "pipe")
