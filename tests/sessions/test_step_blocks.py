"""Reading a session block by block gives the same values as reading it whole."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import SessionError
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_reader import read_activations, read_session
from pdtui.sessions.session_summary import SessionSummaryCounter, summarize_session
from pdtui.sessions.streams.step_block import StepBlock, step_block_of_records
from pdtui.sessions.streams.step_block_reader import read_step_blocks
from pdtui.sessions.streams.stream_differences import find_first_stream_difference
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.sessions.conftest import Recorded

ARRAYS = ("digests", "episodes", "attributes", "rewards", "costs")


def read_blocks(path: Path, **options: int) -> list[StepBlock]:
    header = read_session_header(path)
    return list(read_step_blocks(header, activations=True, poses=True, **options))


@pytest.mark.parametrize("block_steps", [1, 7, 64, 1000])
def test_blocks_of_any_size_hold_what_the_whole_session_holds(block_steps: int, recorded: Recorded) -> None:
    path = recorded[0]
    session, activations = read_session(path), read_activations(path)
    blocks = read_blocks(path, block_steps=block_steps)
    assert [len(block) for block in blocks[:-1]] == [block_steps] * (len(blocks) - 1)
    for name in ARRAYS:
        joined = np.concatenate([getattr(block, name) for block in blocks])
        np.testing.assert_array_equal(joined, getattr(session, name))
    np.testing.assert_array_equal(np.concatenate([block.actions for block in blocks]), session.actions)
    found = [block.activations for block in blocks if block.activations is not None]
    np.testing.assert_array_equal(np.concatenate(found), activations)
    assert sum((block.active for block in blocks), ()) == session.active
    assert sum((block.stimulations for block in blocks), ()) == session.stimulations
    assert sum((block.natural for block in blocks), ()) == session.natural
    assert {step: text for block in blocks for step, text in block.endings.items()} == session.endings


@pytest.mark.parametrize("rows_per_write", [1, 4, 128])
def test_what_is_read_is_what_was_recorded(rows_per_write: int, recorded: Recorded, tmp_path: Path) -> None:
    """Long enough that the poses, which are written in larger batches, come long after their steps."""
    _, loop, records = recorded
    many = [records[step % 100]._replace(step=step, events=()) for step in range(1500)]
    with SessionRecorder(tmp_path / "a.rrd", loop.info, rows_per_write=rows_per_write) as recorder:
        for one in many:
            recorder.write(one)
    blocks = read_blocks(tmp_path / "a.rrd", block_steps=256)
    assert sum(len(block) for block in blocks) == 1500
    drawn = []
    for block in blocks:
        same = step_block_of_records(
            many[int(block.steps[0]) : int(block.steps[-1]) + 1], loop.info, block.pose_steps
        )
        assert find_first_stream_difference(same, block, loop.info) is None
        assert same.poses.keys() == block.poses.keys() != set()
        drawn += block.pose_steps.tolist()
    assert drawn == list(range(1500))


def test_a_part_of_a_block_is_the_block_of_the_part(recorded: Recorded) -> None:
    path, loop, records = recorded
    (block,) = read_blocks(path)
    part = block.part(3, 50)
    same = step_block_of_records(records[3:50], loop.info, block.pose_steps)
    assert find_first_stream_difference(same, part, loop.info) is None
    assert part.active == block.active[3:50]
    assert part.stimulations == block.stimulations[3:50]
    np.testing.assert_array_equal(part.pose_steps, same.pose_steps)


def test_rows_in_another_order_are_put_right(recorded: Recorded, tmp_path: Path) -> None:
    """Other programs may write the chunks of a recording in any order."""
    _, loop, records = recorded
    order = [*range(20), *range(40, 60), *range(20, 40), *range(60, 100)]
    with SessionRecorder(tmp_path / "a.rrd", loop.info, rows_per_write=1, view_rows=1) as recorder:
        for step in order:
            recorder.write(records[step]._replace(events=()))
    blocks = read_blocks(tmp_path / "a.rrd", block_steps=8)
    steps = [step for block in blocks for step in block.steps.tolist()]
    assert steps == list(range(100))
    whole = [record._replace(events=()) for record in records]
    for block in blocks:
        first, last = int(block.steps[0]), int(block.steps[-1])
        same = step_block_of_records(whole[first : last + 1], loop.info)
        assert find_first_stream_difference(same, block, loop.info) is None


def test_a_missing_step_is_an_error_unless_it_is_a_known_gap(recorded: Recorded, tmp_path: Path) -> None:
    _, loop, records = recorded
    path = tmp_path / "a.rrd"
    with SessionRecorder(path, loop.info, rows_per_write=4) as recorder:
        for one in records:
            if not 30 <= one.step < 35 and one.step != 80:
                recorder.write(one._replace(events=()))
    with pytest.raises(SessionError, match=r"a\.rrd: expected control step 30, found step 35"):
        read_blocks(path)
    header = replace(read_session_header(path), steps=100, gaps=((30, 35), (80, 81)))
    blocks = list(read_step_blocks(header, block_steps=16))
    steps = [step for block in blocks for step in block.steps.tolist()]
    assert steps == [*range(30), *range(35, 80), *range(81, 100)]


def test_the_summary_does_not_depend_on_the_size_of_the_blocks(recorded: Recorded) -> None:
    path, loop, records = recorded
    keyed = {event.step for record in records for event in record.events if event.key}
    many = [records[step % 100] for step in range(2500)]
    summaries = []
    for size in (1, 4, 128, 2500):
        counter = SessionSummaryCounter(loop.info)
        for start in range(0, 2500, size):
            rows = many[start : start + size]
            counter.add(
                attributes=np.array([one.attributes for one in rows]),
                rewards=np.array([one.reward for one in rows]),
                costs=np.array([one.cost for one in rows]),
                episodes=np.array([one.episode for one in rows]),
                involved=np.array([one.step in keyed for one in rows]),
                stimulated=np.array([bool(one.stimulation.units) for one in rows]),
                taken_over=np.zeros(len(rows), bool),
            )
        summaries.append(counter.summary())
    assert all(asdict(one) == asdict(summaries[0]) for one in summaries)
    session, summary = read_session(path), summarize_session(read_session_header(path))
    assert summary.involvement == len(keyed)
    assert summary.total_reward == pytest.approx(float(session.rewards.sum()), rel=1e-12)
    assert summary.stimulated == sum(bool(one.units) for one in session.stimulations)
    np.testing.assert_allclose([one.mean for one in summary.attributes], session.attributes.mean(axis=0))
    np.testing.assert_allclose([one.std for one in summary.attributes], session.attributes.std(axis=0))
