"""Files are replaced whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pdtui.core.atomic_file import check_writable, replace_file, write_file
from pdtui.core.errors import MapError


def test_a_file_is_replaced_whole_and_nothing_is_left_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.txt"
    write_file(path, "näw", MapError)
    assert path.read_bytes() == "näw".encode()
    with replace_file(path, MapError) as partial:
        partial.write_bytes(b"half")
        assert path.read_bytes() == "näw".encode()
    assert path.read_bytes() == b"half"
    assert list(path.parent.iterdir()) == [path]


def test_what_fails_half_way_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), replace_file(path, MapError) as partial:
        partial.write_text("hal")
        raise ZeroDivisionError
    with pytest.raises(MapError, match=r"a\.txt: cannot be written: No space"), replace_file(path, MapError):
        raise OSError(28, "No space left on device")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_a_link_and_its_target_keeps_its_permissions(tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    write_file(link, "new", MapError)
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert target.stat().st_mode & 0o777 == 0o640


def test_a_new_file_has_the_permissions_of_any_other(tmp_path: Path) -> None:
    write_file(tmp_path / "a", b"", MapError)
    (tmp_path / "b").touch()
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


def test_a_pipe_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        check_writable(pipe, MapError)
        write_file(pipe, "through", MapError)
        assert os.read(reader, 100) == b"through"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_it_is_known_before_whether_a_file_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with pytest.raises(MapError, match="file/a: cannot be written: "):
        check_writable(tmp_path / "file" / "a", MapError)
    check_writable(tmp_path / "file", MapError)
    check_writable(tmp_path / "new" / "a", MapError)
    assert (tmp_path / "file").read_text() == "kept"
    assert not list((tmp_path / "new").iterdir())
