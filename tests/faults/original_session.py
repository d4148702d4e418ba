"""Whole sessions whose every message is known, and the comparison of what is left of them."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import events_of_pressed_keys
from pdtui.driving.loop_builder import build_control_loop
from pdtui.sessions.rrd.chunk_stream import ChunkStream
from pdtui.sessions.rrd.message_decoder import EntityChunk
from pdtui.sessions.rrd.message_framing import LAST, START_BYTES, RrdMessageSpan, read_message_spans
from pdtui.sessions.rrd.message_reader import decode_message
from pdtui.sessions.rrd.rrd_contents import PROPERTIES
from pdtui.sessions.session_reader import Session, read_activations, read_session
from pdtui.sessions.session_schema import DRIVE, EVENTS, STEP
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_reader import load_map
from tests.faults.fault_bench import FaultBench, list_recorded_steps
from tests.faults.fault_tally import FalseReport, StepsLost

KEYS = ("w", "t", "h", "space", "r")
STREAMS = ("digests", "attributes", "actions", "rewards", "costs", "episodes")
PER_STEP = ("active", "stimulations", "natural")

Rows = Counter[tuple[str, int]]
"""Number of rows by entity and control step, which is -1 for data that belong to none."""


class OriginalSession:
    """A whole session, and what each of its messages contains.

    Attributes:
        path, data: the file and its bytes.
        session, activations: its contents; no activations if it has none.
        spans: its messages.
        begin: the byte behind the message with the first control step.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.data = path, path.read_bytes()
        self.session, self.activations = read_session(path), read_activations(path)
        with io.BytesIO(self.data) as file:
            self.spans = list(read_message_spans(file, len(self.data)))
        self._chunks = [self._decode(span) for span in self.spans]
        self._rows = [count_rows([chunk] if chunk is not None else []) for chunk in self._chunks]
        self._first = next(number for number, rows in enumerate(self._rows) if _steps_of(rows))
        self.begin = self.spans[self._first].end

    def find_message(self, place: int) -> int:
        """Return the number of the message in which a byte is; -1 for the start of the file."""
        for number, span in enumerate(self.spans):
            if span.begin <= place < span.end:
                return number
        assert place < START_BYTES
        return -1

    def rows_without(self, messages: Iterable[int]) -> tuple[NDArray[np.int64], Rows]:
        """Return the control steps and all rows that are left without some messages."""
        left: Rows = sum((rows for n, rows in enumerate(self._rows) if n not in set(messages)), Counter())
        return np.array(sorted(_steps_of(left)), np.int64), left

    def _decode(self, span: RrdMessageSpan) -> EntityChunk | None:
        if span.kind == LAST:
            return None
        decoded = decode_message(span, memoryview(self.data)[span.start : span.start + span.length])
        return decoded[1] if decoded is not None and decoded[0].is_recording else None


def count_rows(chunks: Iterable[EntityChunk]) -> Rows:
    """Count rows, but for those that a repair writes anew."""
    rows: Rows = Counter()
    for chunk in chunks:
        if chunk.entity == EVENTS or chunk.entity.startswith(PROPERTIES.rstrip("/")):
            continue
        if STEP in chunk.timelines:
            rows.update((chunk.entity, step) for step in chunk.batch.column(STEP).to_pylist())
        else:
            rows[chunk.entity, -1] += chunk.batch.num_rows
    return rows


def _steps_of(rows: Rows) -> list[int]:
    return [step for entity, step in rows if entity == DRIVE]


def record_original(bench: FaultBench, name: str, *, steps: int, rows_per_write: int) -> OriginalSession:
    """Drive with random keys, and with a map that is written into the file."""
    drawn = bench.drawn
    config = DriveConfig("ant", load_map(bench.map_path), drawn.randrange(1000))
    loop = build_control_loop(config, bench.robot, bench.policy)
    path = bench.folder / f"{name}.rrd"
    with SessionRecorder(path, loop.info, rows_per_write=rows_per_write) as recorder:
        for _ in range(steps):
            # Steps with keys are written at once: with as many, no batch would be large.
            pressed = [drawn.choice(KEYS)] if drawn.random() < 0.4 / rows_per_write else []
            recorder.write(loop.advance(events_of_pressed_keys(pressed, loop)))
        recorder.close("finished")
    return OriginalSession(path)


def list_differences(session: Session, activations: NDArray[np.float32], original: OriginalSession) -> str:
    """Return which streams differ from the original's in the control steps that are left; "" if none does."""
    left, before = list_recorded_steps(session), original.session
    differ = [
        name for name in STREAMS if getattr(session, name).tobytes() != getattr(before, name)[left].tobytes()
    ]
    differ += [
        name
        for name in PER_STEP
        # As text, since there is NaN for what a behavior does not have.
        if repr(getattr(session, name)) != repr(_pick(getattr(before, name), left))
    ]
    if activations.tobytes() != original.activations[left].tobytes():
        differ.append("activations")
    return ", ".join(differ)


def _pick(values: Sequence[object], steps: NDArray[np.int64]) -> tuple[object, ...]:
    return tuple(values[step] for step in steps.tolist())


def require_all_but(path: Path, original: OriginalSession, messages: Sequence[int], *, cut: bool) -> int:
    """Compare a repaired session with its original, which had damage in some messages.

    Everything else has to be there, and the same; for a file that was `cut`, also the events up to its last
    step. Returns the number of control steps that are missing.
    """
    session, before = read_session(path), original.session
    wanted, rows = original.rows_without(messages)
    left = list_recorded_steps(session)
    if gone := sorted(set(wanted.tolist()) - set(left.tolist())):
        raise StepsLost(f"steps {gone[:3]}… are missing, which were not damaged")
    if more := sorted(set(left.tolist()) - set(wanted.tolist())):
        raise FalseReport(f"steps {more[:3]}… are there, which were damaged")
    if differ := list_differences(session, read_activations(path), original):
        raise FalseReport(f"repaired, differs from what was recorded: {differ}")
    total = session.steps
    kept = Counter({row: number for row, number in rows.items() if row[1] < total})
    there = count_rows(ChunkStream(path))
    if kept != there:
        raise StepsLost(
            f"rows for the viewer are missing or doubled: {list((kept - there) + (there - kept))[:3]}"
        )
    if not cut and total != before.steps:
        raise FalseReport(f"{before.steps} steps were recorded; {total} are said, without a gap at the end")
    if session.events != tuple(event for event in before.events if event.step < total):
        raise StepsLost("events are missing")
    for name in ("info", "versions", "created") + (() if cut else ("outcome", "endings", "outcomes")):
        if getattr(session, name) != getattr(before, name):
            raise StepsLost(f"{name} is {getattr(session, name)}, was {getattr(before, name)}")
    return before.steps - len(left)
