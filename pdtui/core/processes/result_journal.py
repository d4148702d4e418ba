"""A file of finished jobs, with which an interrupted command goes on without loss."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import PdtuiError

Job = TypeVar("Job")
Result = TypeVar("Result")


class ResultJournal(Generic[Result]):
    """Keeps the results of jobs, one JSON object per line, each with a key that determines its job.

    A line that was cut off, because the command was killed while it wrote it, is removed.

    Args:
        path: The file; None keeps nothing.
        encode: Returns the fields of a result.
        decode: Returns the result of such fields, with every bit.
        holds: What the file holds, for error messages.
        key_field: The field of the key.

    Raises:
        PdtuiError: The file cannot be read or written, or a line is no result.
    """

    def __init__(
        self,
        path: Path | None,
        encode: Callable[[Result], Mapping[str, Any]],
        decode: Callable[[dict[str, Any]], Result],
        holds: str,
        key_field: str = "job",
    ) -> None:
        self._path, self._encode, self._decode = path, encode, decode
        self._holds, self._key_field = holds, key_field
        self._results: dict[str, Result] = {}
        if path is not None and path.exists():
            self._read(path)

    def __len__(self) -> int:
        return len(self._results)

    def find(self, key: str) -> Result | None:
        """Return the result of a job that was kept; None if there is none."""
        return self._results.get(key)

    def keep(self, key: str, result: Result) -> None:
        """Keep the result of a job. It then survives the end of this process.

        Raises:
            PdtuiError: The file cannot be written.
        """
        self._results[key] = result
        if self._path is None:
            return
        line = json.dumps({self._key_field: key, **self._encode(result)}, default=_to_number)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            raise PdtuiError(f"{self._path}: cannot be written: {error.strerror}") from error

    def _read(self, path: Path) -> None:
        try:
            content = path.read_bytes()
            whole = content[: content.rfind(b"\n") + 1]
            lines = whole.decode().splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise PdtuiError(f"{path}: cannot be read as a journal: {error}") from error
        for number, line in enumerate(lines, start=1):
            try:
                fields = json.loads(line)
                key = fields.pop(self._key_field)
                self._results[key] = self._decode(fields)
            except (ValueError, TypeError, KeyError, AttributeError, zlib.error) as error:
                raise PdtuiError(f"{path}: line {number}: expected {self._holds}") from error
        if whole != content:
            begun, start = content[len(whole) :], f'{{"{self._key_field}": '.encode()
            if not begun.startswith(start) and not start.startswith(begun):
                raise PdtuiError(f"{path}: line {len(lines) + 1}: expected {self._holds}")
            try:
                with path.open("r+b") as file:
                    file.truncate(len(whole))
            except OSError as error:
                raise PdtuiError(f"{path}: cannot be written: {error.strerror}") from error


@dataclass(frozen=True)
class KeyedResultJournal(Generic[Job, Result]):
    """A journal of jobs whose keys follow from the jobs.

    Attributes:
        results: The journal.
        key: Returns everything that determines the result of a job, as text.
    """

    results: ResultJournal[Result]
    key: Callable[[Job], str]


def map_missing(
    as_completed: Callable[[Sequence[Job]], Iterator[tuple[int, Result]]],
    jobs: Sequence[Job],
    journal: KeyedResultJournal[Job, Result] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Result]:
    """Run the jobs whose results a journal does not hold, add these to it, and return all in order.

    Args:
        as_completed: Runs jobs, and yields the index and the result of each.
        jobs: The jobs.
        journal: The journal; None for none.
        progress: Called with the number of jobs whose results are known, and of all jobs.
    """
    keys = [] if journal is None else [journal.key(job) for job in jobs]
    results: dict[int, Result] = {}
    if journal is not None:
        kept = ((number, journal.results.find(key)) for number, key in enumerate(keys))
        results |= {number: result for number, result in kept if result is not None}
        if results and progress is not None:
            progress(len(results), len(jobs))
    missing = [number for number in range(len(jobs)) if number not in results]
    for index, result in as_completed([jobs[number] for number in missing]):
        number = missing[index]
        results[number] = result
        if journal is not None:
            journal.results.keep(keys[number], result)
        if progress is not None:
            progress(len(results), len(jobs))
    return [results[number] for number in range(len(jobs))]


def encode_array(array: NDArray[Any]) -> dict[str, Any]:
    """Return an array as fields from which `decode_array` makes the same array."""
    packed = base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes()))
    return {"dtype": array.dtype.str, "shape": array.shape, "packed": packed.decode()}


def decode_array(fields: Mapping[str, Any]) -> NDArray[Any]:
    """Return the array of these fields."""
    content = zlib.decompress(base64.b64decode(fields["packed"]))
    return np.frombuffer(content, np.dtype(fields["dtype"])).reshape(fields["shape"]).copy()


def _to_number(value: Any) -> Any:
    """Return a number of NumPy as one of Python."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"not a number: {value!r}")
