"""Results of jobs in a file: what is there is not run again, and what was cut off is run again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pdtui.core.errors import PdtuiError
from pdtui.core.processes.result_journal import (
    KeyedResultJournal,
    ResultJournal,
    decode_array,
    encode_array,
    map_missing,
)


def _open(path: Path | None) -> ResultJournal[float]:
    return ResultJournal(
        path, lambda value: {"value": value}, lambda fields: float(fields["value"]), "a root"
    )


def _key(job: int) -> str:
    return f"root of {job}"


def test_only_what_is_missing_is_run_and_the_order_is_that_of_the_jobs(tmp_path: Path) -> None:
    ran: list[int] = []

    def run(jobs: Sequence[int]) -> Iterator[tuple[int, float]]:
        for index, job in reversed(list(enumerate(jobs))):
            ran.append(job)
            yield index, job**0.5

    told: list[tuple[int, int]] = []
    path = tmp_path / "new" / "roots.jsonl"
    for jobs in ((2, 3), (3, 5, 2, 7)):
        journal = KeyedResultJournal(_open(path), _key)
        found = map_missing(run, jobs, journal, lambda done, of: told.append((done, of)))
        assert found == [job**0.5 for job in jobs]
    assert ran == [3, 2, 7, 5]
    assert told == [(1, 2), (2, 2), (2, 4), (3, 4), (4, 4)]
    assert map_missing(run, [2, 3]) == [2**0.5, 3**0.5]


@pytest.mark.parametrize("cut", ['{"job": "root of 3", "val', '{"j', '{"job": "root of 3", "value": 1.7}'])
def test_a_line_that_was_cut_off_is_removed(tmp_path: Path, cut: str) -> None:
    path = tmp_path / "roots.jsonl"
    _open(path).keep("root of 2", np.float64(2**0.5))
    with path.open("a") as file:
        file.write(cut)
    journal = _open(path)
    assert (len(journal), journal.find("root of 2"), journal.find("root of 3")) == (1, 2**0.5, None)
    journal.keep("root of 3", 3**0.5)
    assert _open(path).find("root of 3") == 3**0.5


@pytest.mark.parametrize(
    "content", ["something else", "something else\n", '{"value": 1}\n', '{"job": "a"}\n']
)
def test_another_file_is_refused_and_stays_as_it_is(tmp_path: Path, content: str) -> None:
    path = tmp_path / "other.txt"
    path.write_text(content)
    with pytest.raises(PdtuiError, match="other.txt: line 1: expected a root"):
        _open(path)
    assert path.read_text() == content


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(PdtuiError, match="file/roots.jsonl: cannot be written"):
        _open(tmp_path / "file" / "roots.jsonl").keep("root of 2", 1.4)


ARRAYS: tuple[Any, ...] = (
    [[1 / 3, np.nan], [-0.0, np.inf]],
    np.full(1, 1 / 3, np.float32),
    0.1,
    np.empty((0, 3)),
)


@pytest.mark.parametrize("given", ARRAYS)
def test_arrays_keep_every_bit(given: Any) -> None:
    array = np.asarray(given)
    again = decode_array(encode_array(array))
    assert (again.dtype, again.shape, again.tobytes()) == (array.dtype, array.shape, array.tobytes())
