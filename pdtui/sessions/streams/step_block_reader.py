"""Read the control steps of a session block by block, so that a long session takes little memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from pdtui.core.errors import SessionError
from pdtui.sessions.rrd.chunk_stream import ChunkStream
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.session_header_decoding import count_control_steps
from pdtui.sessions.session_schema import (
    ACTIVATIONS,
    DIGEST_EPISODE,
    DRIVE,
    HALF_ACTIVATIONS,
    REWARD_COST_ACTION,
    ROBOT,
    STEP,
)
from pdtui.sessions.streams.recorded_poses import RecordedPoses
from pdtui.sessions.streams.step_block import StepBlock
from pdtui.sessions.streams.step_block_decoding import decode_step_block
from pdtui.sessions.streams.step_numbers import number_steps

BLOCK_STEPS = 1024
"""Control steps per block, unless asked otherwise."""

_POSES_LATE = 512
"""Control steps that are read ahead of a block whose poses are wanted: the recorder writes poses in larger
batches than the data of the drive, but not later than this or than four of the largest batches."""

_COLUMNS = {
    *(
        STEP,
        "attributes",
        REWARD_COST_ACTION,
        DIGEST_EPISODE,
        ACTIVATIONS,
        HALF_ACTIVATIONS,
        "stimulation",
        "takeover",
        "behaviors",
        "active",
    )
}
_Batches = list[pa.RecordBatch]


class _AnotherOrderError(Exception):
    """The rows are not in the order of their control steps, or some are missing."""


def read_step_blocks(
    header: SessionHeader, *, activations: bool = False, poses: bool = False, block_steps: int = BLOCK_STEPS
) -> Iterator[StepBlock]:
    """Iterate over the control steps of a session in blocks of at most `block_steps`.

    Every message of the file is checked. Only a block and a few chunks are in memory at a time if the rows of
    the file are in the order of the control steps, as the recorder writes them. If another program has put
    them into another order, they are gathered in memory.

    Args:
        header: the header of the session; its `gaps` are the steps that may be missing.
        activations: whether the blocks contain activations, if they were recorded.
        poses: whether the blocks contain the poses of the robot's shapes.
        block_steps: largest number of control steps per block.

    Raises:
        SessionError: the file is damaged, or a control step is missing; the message names the file.
    """
    queue = RecordedPoses(header) if poses and header.info.links else None
    taken = 0
    try:
        for batches, at_end in _cut_blocks(header.path, block_steps, queue):
            with _named_errors(header.path):
                table = EntityTable(DRIVE, _merge_batches(batches, activations=activations))
                rows = len(table.steps)
                if not np.array_equal(table.steps, number_steps(taken, rows, header.gaps)):
                    raise _AnotherOrderError
                block = _decode(table, header, activations, queue, at_end)
            taken += rows
            yield block
    except _AnotherOrderError:
        whole = _gather_steps(header, activations, queue)
        for start in range(taken, len(whole), block_steps):
            yield whole.part(start, min(start + block_steps, len(whole)))
        taken = len(whole)
    with _named_errors(header.path):
        # A session that is being recorded may have grown since its header was read.
        if header.outcome and taken != header.steps - header.missing:
            raise SessionError(f"expected {header.steps - header.missing} control steps, found {taken}")
        if queue is not None:
            queue.require_all_poses_taken()


def _cut_blocks(path: Path, block_steps: int, queue: RecordedPoses | None) -> Iterator[tuple[_Batches, bool]]:
    """Yield the batches of each block in file order, and whether the end of the file has been read.

    The poses on the way are added to the queue.
    """
    pending: _Batches = []
    rows = largest = 0
    for chunk in ChunkStream(path):
        if STEP not in chunk.timelines:
            continue
        if chunk.entity == ROBOT and queue is not None:
            with _named_errors(path):
                queue.add(chunk.batch)
        elif chunk.entity == DRIVE:
            pending.append(chunk.batch)
            rows += chunk.batch.num_rows
            largest = max(largest, chunk.batch.num_rows)
            ahead = 0 if queue is None else max(_POSES_LATE, 4 * largest)
            while rows >= block_steps + ahead:
                block, pending = _split_batches(pending, block_steps)
                rows -= block_steps
                yield block, False
    while pending:
        block, pending = _split_batches(pending, block_steps)
        yield block, True


def _split_batches(batches: _Batches, rows: int) -> tuple[_Batches, _Batches]:
    """Split batches after this number of rows, if there are as many."""
    taken: _Batches = []
    for place, batch in enumerate(batches):
        if batch.num_rows > rows:
            return [*taken, batch.slice(0, rows)], [batch.slice(rows), *batches[place + 1 :]]
        taken.append(batch)
        rows -= batch.num_rows
        if not rows:
            return taken, batches[place + 1 :]
    return taken, []


def _merge_batches(batches: _Batches, *, activations: bool) -> _Batches:
    """Join batches that have the same columns: decoding a hundred short ones takes much longer."""

    def columns(batch: pa.RecordBatch) -> tuple[tuple[str, int, pa.DataType], ...]:
        found = zip(batch.schema.names, range(batch.num_columns), batch.schema.types, strict=True)
        kept = {one[0]: one for one in found if one[0] in _COLUMNS}
        return tuple(
            one for name, one in kept.items() if activations or name not in (ACTIVATIONS, HALF_ACTIVATIONS)
        )

    merged = []
    for found, run in groupby(batches, columns):
        parts = list(run)
        arrays = [pa.concat_arrays([part.column(place) for part in parts]) for _, place, _ in found]
        merged.append(pa.RecordBatch.from_arrays(arrays, [name for name, _, _ in found]))
    return merged


def _decode(
    table: EntityTable, header: SessionHeader, activations: bool, queue: RecordedPoses | None, at_end: bool
) -> StepBlock:
    low, high = (int(table.steps[0]), int(table.steps[-1])) if len(table.steps) else (0, -1)
    others: dict[str, Any] = {
        name: {step: said for step, said in found.items() if low <= step <= high and step in table.steps}
        for name, found in (("endings", header.endings), ("outcomes", header.outcomes))
    }
    if queue is not None:
        others["pose_steps"], others["poses"] = queue.take(low, high, at_end=at_end)
    return decode_step_block(table, header.info, activations=activations, **others)


def _gather_steps(header: SessionHeader, activations: bool, queue: RecordedPoses | None) -> StepBlock:
    with _named_errors(header.path):
        # First without the large columns: usually, a step is missing.
        count_control_steps(RrdContents(header.path, only=(DIGEST_EPISODE,)).table(DRIVE), header.gaps)
        if queue is not None:
            queue.gather()
        skipped = () if activations else (ACTIVATIONS, HALF_ACTIVATIONS)
        return _decode(RrdContents(header.path, skip=skipped).table(DRIVE), header, activations, queue, True)


@contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except SessionError as error:
        known = str(error).startswith(f"{path}: ")
        raise error if known else SessionError(f"{path}: {error}") from error
    except pa.ArrowException as error:
        why = " ".join(str(error).split())[:200]
        raise SessionError(f"{path}: a stream is damaged: {why}") from error
