"""Tasks through the evaluation: judged at the press, and again at the end of a long hold."""

from __future__ import annotations

import pytest

from pdtui.driving.control_loop import ControlLoop
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.evaluation.task_evaluation import (
    TaskEvaluation,
    count_task_steps,
    list_task_runs,
    run_task_episode,
    summarise_tasks,
)
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict
from pdtui.stimulation.map_reader import parse_map
from tests.turning_robot import Vehicle, turning_loop

SMALL = ProtocolSettings(hold_steps=400, hold_seconds=0.0, window_seconds=1.0, draws=3, draw_seeds=2)
MAP = """
schema = 1
robot = "vehicle"
[policy]
name = "none"
sha256 = "none"
[[behaviors]]
name = "veer"
key = "a"
magnitudes = { "0:0" = 0.5 }
task = "veer"
[[behaviors]]
name = "flick"
key = "d"
magnitudes = { "0:0" = 0.5 }
period = 0.5
task = "veer"
"""


def _judge(trace: TaskRunTrace) -> TaskVerdict:
    turned = float(trace["yaw"][-1] - trace["yaw"][0])
    return TaskVerdict(trace.stays_up(50) and turned > 0.3, turned, {"turned (rad)": turned})


class _Veering(Vehicle):
    tasks = (Task("veer", "v", "veers", "turns by 0.3 rad in 1 s", (10, 20), 50, _judge),)


@pytest.fixture(scope="module")
def plan() -> EvaluationPlan:
    policy: Policy = turning_loop().policy
    return EvaluationPlan(ControlLoop(_Veering(), policy, parse_map(MAP, "test"), 0), range(100, 108), SMALL)


@pytest.fixture(scope="module")
def rows(plan: EvaluationPlan) -> tuple[TaskEvaluation, ...]:
    return summarise_tasks(plan, {run: run_task_episode(plan.loop, run) for run in list_task_runs(plan)})


def test_a_held_task_is_judged_twice_and_a_flick_once(
    plan: EvaluationPlan, rows: tuple[TaskEvaluation, ...]
) -> None:
    veer, flick = rows
    assert (veer.done, veer.by_itself, veer.still_done, veer.falls) == (8, 0, 8, 0)
    assert (flick.done, flick.still_done) == (0, None)  # half a second turns it by too little
    assert veer.figures["turned (rad)"] > 0.3
    assert 0.2 < flick.figures["turned (rad)"] < 0.25
    assert veer.figures_by_itself["turned (rad)"] == pytest.approx(0.0)
    steps = [count_task_steps(plan, run) for run in list_task_runs(plan) if run.behavior == "veer"]
    assert all(410 <= one <= 432 for one in steps[:8])
    assert all(60 <= one <= 70 for one in steps[8:])


def test_successes_are_tested_in_pairs_and_corrected(rows: tuple[TaskEvaluation, ...]) -> None:
    veer, flick = rows
    assert veer.p_value == pytest.approx(2 / 2**8)
    assert veer.corrected == pytest.approx(2 * veer.p_value)
    assert veer.holds
    assert (flick.p_value, flick.holds) == (1.0, False)
    assert veer.low == pytest.approx(0.6306, abs=1e-4)  # Clopper and Pearson's for 8 of 8
    assert veer.high == 1.0


def test_random_units_are_judged_by_the_same_task(rows: tuple[TaskEvaluation, ...]) -> None:
    veer, flick = rows
    assert (veer.draws, veer.draw_seeds, veer.as_good) == (3, 2, 0)  # the other unit changes the pace
    assert flick.as_good == 3  # nothing is as good as a behavior that fails
