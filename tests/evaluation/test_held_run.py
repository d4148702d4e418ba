"""Runs of an evaluation, undisturbed and disturbed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.evaluation.disturbance_conditions import CONDITIONS, UNDISTURBED, find_condition, plan_pushes
from pdtui.evaluation.held_run import (
    HeldRunPlan,
    drive_held_run,
    measure_intervention,
    record_held_run,
    run_held_behavior,
)
from pdtui.evaluation.protocol_settings import RunTimes
from pdtui.robots import make_robot
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.streams.step_block_reader import read_step_blocks
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.turning_robot import Vehicle, turning_loop

TIMES = RunTimes(press=20, held=20, after=10, window=10, bin=5, dt=0.05)


@pytest.fixture(scope="module")
def loop(small_map: StimulationMap) -> ControlLoop:
    return build_control_loop(DriveConfig("ant", small_map, 0))


def test_a_behavior_is_held_from_the_press_to_the_release(loop: ControlLoop) -> None:
    records = list(drive_held_run(loop, HeldRunPlan("push", 3, TIMES)))
    on = [record.step for record in records if record.behaviors]
    assert (on[0], on[-1], len(on), len(records)) == (20, 39, 20, 50)
    assert not any(record.behaviors for record in drive_held_run(loop, HeldRunPlan("", 3, TIMES)))


def test_a_trace_has_means_over_bins_from_the_press_on(loop: ControlLoop) -> None:
    plan = HeldRunPlan("push", 3, TIMES)
    records, trace = list(drive_held_run(loop, plan)), run_held_behavior(loop, plan)
    rows = np.array([record.attributes for record in records])
    column = loop.robot.attribute_index("vy")
    assert trace.values[:, column] == pytest.approx(rows[20:, column].reshape(6, 5).mean(axis=1))
    assert trace.places[2] == pytest.approx(records[34].poses[0, :2])
    assert trace.outcome is None
    assert trace.ended_at is None


def test_a_recorded_run_is_the_run_and_replays(loop: ControlLoop, tmp_path: Path) -> None:
    plan, path = HeldRunPlan("push", 3, TIMES), tmp_path / "run.rrd"
    record_held_run(loop, plan, path)
    header = read_session_header(path)
    pressed = [(event.step, event.kind, event.name) for event in header.events]
    assert pressed == [(20, "behavior", "push"), (40, "default", "")]
    assert replay_session(path).identical
    (block,) = read_step_blocks(header)
    assert block.digests.tolist() == [record.digest for record in drive_held_run(loop, plan)]


class _Tipping(Vehicle):
    """Tips over in a given control step of each episode."""

    def __init__(self, step: int) -> None:
        super().__init__()
        self.tips_in, self.steps = step, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        self.steps = 0
        return super().reset(seed=seed, options=options)

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        self.steps += 1
        observation, reward, _, truncated, info = super().step(action)
        return observation, reward, self.steps == self.tips_in, truncated, info


@pytest.mark.parametrize(("step", "ended_at"), [(11, -10), (21, 0), (50, 29), (51, None)])
def test_a_fall_is_counted_from_the_press_and_ends_the_trace(step: int, ended_at: int | None) -> None:
    standing = turning_loop()
    tipping = ControlLoop(_Tipping(step), standing.policy, standing.map, 0)
    for name in ("turn", ""):
        trace = run_held_behavior(tipping, HeldRunPlan(name, 1, TIMES))
        assert trace.ended_at == ended_at
        assert trace.outcome == (None if ended_at is None else Outcome.FELL)
        assert np.isfinite(trace.values[:, 0]).sum() == max(0, min(50, step) - 20) // 5


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda one: one.name)
def test_every_condition_repeats_itself_and_leaves_no_trace(loop: ControlLoop, condition: Any) -> None:
    times = RunTimes(press=70, held=20, after=10, window=10, bin=5, dt=0.05)
    spread = measure_intervention(loop, HeldRunPlan("", 3, times)).observation_spread
    usual = [record.digest for record in drive_held_run(loop, HeldRunPlan("push", 3, times))]
    plan = HeldRunPlan("push", 3, times, condition, observation_spread=spread)
    disturbed = [record.digest for record in drive_held_run(loop, plan)]
    assert [record.digest for record in drive_held_run(loop, plan)] == disturbed
    assert (disturbed == usual) == (condition is UNDISTURBED)
    assert [record.digest for record in drive_held_run(loop, HeldRunPlan("push", 3, times))] == usual


def test_pushes_come_every_few_seconds_and_are_those_of_the_seed() -> None:
    hard = find_condition("pushed hard")
    pushes = plan_pushes(hard, 4, 0.05, 2000)
    gaps = np.diff([0, *pushes])
    assert 20 <= gaps.min() < gaps.max() <= 60
    assert np.abs(list(pushes.values())).max() <= 1.6
    assert np.abs(list(pushes.values())).max() > 1.2
    assert pushes == plan_pushes(hard, 4, 0.05, 2000) != plan_pushes(hard, 5, 0.05, 2000)
    assert plan_pushes(UNDISTURBED, 4, 0.05, 2000) == {}


def test_a_robot_offers_only_what_it_can_do() -> None:
    offered = {one.name for one in CONDITIONS if one.is_offered(Vehicle())}
    assert offered == {"undisturbed", "noisy sensors", "spread starts"}
    assert all(one.is_offered(make_robot("walker")) for one in CONDITIONS)
