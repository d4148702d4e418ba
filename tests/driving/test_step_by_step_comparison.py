"""A recording that is watched: on another machine, what rounding explains is no difference."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.replays.step_by_step_comparison import StepByStepComparison
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.sessions.session_header import SessionHeader, read_session_header
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.stimulation_map import StimulationMap


@pytest.fixture(scope="module")
def recorded(
    tmp_path_factory: pytest.TempPathFactory, policy: Policy, small_map: StimulationMap
) -> tuple[SessionHeader, list[StepRecord]]:
    loop = ControlLoop(make_robot("ant"), policy, small_map, 3)
    path: Path = tmp_path_factory.mktemp("watched") / "a.rrd"
    with SessionRecorder(path, loop.info) as recorder:
        records = [loop.advance() for _ in range(8)]
        for record in records:
            recorder.write(record)
        recorder.close("finished")
    return read_session_header(path), records


def changed(record: StepRecord, change: float) -> StepRecord:
    return record._replace(activations=record.activations + record.activations.dtype.type(change))


def test_what_rounding_explains_counts_only_where_the_session_was_recorded(
    recorded: tuple[SessionHeader, list[StepRecord]],
) -> None:
    header, records = recorded
    elsewhere = replace(header, versions={**header.versions, "numpy": "0.1"})
    here, there = (StepByStepComparison(one, header.info) for one in (header, elsewhere))
    assert here.compare(records[0]) == there.compare(records[0]) == ""
    rounded = changed(records[1], 1e-6)
    assert here.compare(rounded).startswith("step 1 differs from the session: activations 0:0")
    assert there.compare(rounded) == ""
    for record in records[2:]:
        assert there.compare(record) == ""
    assert there.ended
    assert there.verdict == "bits differ from step 1 on, as elsewhere they may; 8 steps"
    same = StepByStepComparison(elsewhere, header.info)
    assert [same.compare(record) for record in records] == [""] * 8
    assert same.verdict == "identical, 8 steps"
    damaged = StepByStepComparison(elsewhere, header.info)
    assert damaged.compare(changed(records[0], 0.01)).startswith("step 0 differs from the session")
