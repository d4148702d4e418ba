"""Tasks through the evaluation: at the press, after a long hold, disturbed, and beside substitutes."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from rich.console import Console

from pdtui.core.outcome import Outcome
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import MapEvaluation, evaluate_behaviors, plan_evaluation
from pdtui.evaluation.behavior_substitutes import InterventionSize, draw_random_direction
from pdtui.evaluation.behavior_tables import behavior_tables
from pdtui.evaluation.disturbance_conditions import CONDITIONS
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.held_run import InterventionMeasurement, measure_intervention
from pdtui.evaluation.paired_statistics import holm_correction
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.evaluation.tasks.task_runs import (
    count_task_steps,
    list_task_runs,
    plan_task_episode,
    run_task_episode,
    task_measuring_runs,
)
from pdtui.evaluation.tasks.task_success import TaskEvaluation
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map, parse_map
from tests.turning_robot import Vehicle, turning_loop

SMALL = ProtocolSettings(
    hold_steps=400, hold_seconds=0.0, window_seconds=1.0, draws=24, draw_seeds=2, condition_seeds=3
)
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
def result(plan: EvaluationPlan) -> MapEvaluation:
    return evaluate_behaviors(DriveConfig("vehicle", plan.loop.map, 0), plan)


@pytest.fixture(scope="module")
def rows(result: MapEvaluation) -> list[TaskEvaluation]:
    return [row for row in result.tasks if row.condition == "undisturbed"]


def test_a_held_task_is_judged_twice_and_a_flick_once(
    plan: EvaluationPlan, rows: list[TaskEvaluation]
) -> None:
    veer, flick = rows
    assert (veer.done, veer.by_itself, veer.still_done, veer.outcomes) == (8, 0, 8, {Outcome.FELL: 0})
    assert (flick.done, flick.still_done) == (0, None)  # half a second turns it by too little
    assert veer.figures["turned (rad)"] > 0.3
    assert 0.2 < flick.figures["turned (rad)"] < 0.25
    assert veer.figures_by_itself["turned (rad)"] == pytest.approx(0.0)
    steps = [count_task_steps(plan, run) for run in list_task_runs(plan) if run.behavior == "veer"]
    assert all(410 <= one <= 432 for one in steps[:8])
    assert all(60 <= one <= 70 for one in steps[8:])


def test_successes_are_tested_in_pairs_and_corrected(rows: list[TaskEvaluation]) -> None:
    veer, flick = rows
    assert veer.p_value == pytest.approx(2 / 2**8)
    assert veer.corrected == pytest.approx(2 * veer.p_value)
    assert veer.holds
    assert (flick.p_value, flick.holds) == (1.0, False)
    assert veer.low == pytest.approx(0.6306, abs=1e-4)  # Clopper and Pearson's for 8 of 8
    assert veer.high == 1.0


def test_substitutes_are_judged_by_the_same_task(rows: list[TaskEvaluation]) -> None:
    units, directions, actions = rows[0].substitutes
    # The other unit changes the pace.
    assert (units.kind, units.draws, units.seeds, units.as_good, units.done) == ("random units", 24, 2, 0, 0)
    # The unit is the action, so a push on the actions is the behavior itself.
    assert (actions.kind, actions.draws, actions.as_good, actions.done) == ("actions", 1, 1, 2)
    assert (actions.own_done, actions.outcomes) == (2, {Outcome.FELL: 0})
    size = InterventionSize({0: 0.5}, ())
    drawn = [draw_random_direction(size, (2,), "veer", draw).added[0] for draw in range(24)]
    enough = 0.5 * 0.3 / rows[0].figures["turned (rad)"]  # it turns in proportion to its first action
    turning = sum(first > enough for first, _ in drawn)
    assert 0 < turning < 24
    assert directions.kind == "random directions"
    assert (directions.as_good, directions.done) == (turning, 2 * turning)
    # Nothing is worse than a behavior that fails.
    assert [one.as_good for one in rows[1].substitutes] == [24, 24, 1]


def test_a_task_is_disturbed_as_far_as_the_robot_offers_it(
    plan: EvaluationPlan, result: MapEvaluation
) -> None:
    disturbed = [row for row in result.tasks if row.condition != "undisturbed"]
    named = [(row.behavior, row.condition, row.runs) for row in disturbed]
    assert named == [
        (behavior, condition, 3)
        for condition in ("noisy sensors", "spread starts")
        for behavior in ("veer", "flick")
    ]
    assert [row.done for row in disturbed] == [3, 0, 3, 0]
    assert [row.still_done for row in disturbed] == [None] * 4
    assert not any(row.substitutes for row in disturbed)
    assert [row.corrected for row in disturbed] == pytest.approx(
        holm_correction([row.p_value for row in disturbed])
    )
    assert "pushed" in result.not_offered
    steps = [count_task_steps(plan, run) for run in list_task_runs(plan) if run.condition != "undisturbed"]
    assert all(60 <= one <= 70 for one in steps)  # no long hold


def test_the_tables_show_every_condition_and_every_substitute(result: MapEvaluation) -> None:
    console = Console(width=200)
    with console.capture() as shown:
        console.print(behavior_tables(result))
    text = shown.get()
    assert re.search(r"veer .*8/8 \[63%, 100%\] .* 0/8 .* yes .* 8/8 ", text)
    assert re.search(r"spread starts .* 3/3 .* 0/3 .* no .* 0/3 \(0\)", text)
    assert re.search(r"veer .* 0/24, 0/48, 0/48 .* 1/1, 2/2, 0/2", text)
    assert "Not offered by vehicle: pushed, pushed hard, friction −20 %" in text


REAL = ProtocolSettings(
    hold_steps=1, hold_seconds=0.0, window_seconds=0.5, draws=1, draw_seeds=1, condition_seeds=1
)
NEEDS_BULLET = pytest.mark.skipif(find_spec("pybullet") is None, reason="PyBullet is not installed")


def _config_of_one(robot: str, behavior: str) -> DriveConfig:
    shipped = load_map(find_map(robot))
    return DriveConfig(robot, replace(shipped, behaviors={behavior: shipped.behaviors[behavior]}), 0)


@pytest.mark.parametrize(
    ("robot", "behavior"),
    [
        ("bipedal_walker", "rise from split"),
        pytest.param("walker", "brake", marks=pytest.mark.slow),
        pytest.param("a1", "bend left", marks=[pytest.mark.slow, NEEDS_BULLET]),
    ],
)
def test_tasks_of_shipped_robots_are_disturbed_in_every_way(robot: str, behavior: str) -> None:
    config = _config_of_one(robot, behavior)
    result = evaluate_behaviors(config, plan_evaluation(config, [100], REAL))
    assert [row.condition for row in result.tasks] == [one.name for one in CONDITIONS]
    assert [row.runs for row in result.tasks] == [1] * len(CONDITIONS)
    kinds = [(one.kind, one.draws) for one in result.tasks[0].substitutes]
    assert kinds == [("random units", 1), ("random directions", 1), ("actions", 1)]
    # On the same seed, each world gives the behavior other measures.
    measures = {tuple(row.figures.values()) for row in result.tasks}
    assert len(measures) == len(CONDITIONS)


@NEEDS_BULLET
def test_a_task_of_the_a1_is_planned_in_every_world_and_runs_there() -> None:
    plan = plan_evaluation(_config_of_one("a1", "bend left"), [100], REAL)
    usual = [run for run in list_task_runs(plan) if run.pressed and run.kind == "units"]
    assert [run.condition for run in usual] == [one.name for one in CONDITIONS]
    measured = {"": [InterventionMeasurement(None, np.zeros(93))]}
    figures = []
    for run in (usual[1], usual[3], usual[6]):  # pushed, friction −20 %, mass +20 %
        episode = plan_task_episode(plan, run, measured)
        assert episode is not None
        result = run_task_episode(plan.loop, episode)
        figures.append(tuple(result.verdict.figures.values()))
        assert result.outcome is None
    assert len(set(figures)) == 3


def test_a_push_is_measured_from_the_start_of_the_task_on() -> None:
    plan = plan_evaluation(_config_of_one("bipedal_walker", "rise from split"), [100], REAL)
    (run,) = task_measuring_runs(plan)
    # It is pressed at once, in a split, and measured for the half second that is less than its period.
    assert (run.start, run.times.press, run.times.window) == ("split", 0, 36)
    found = measure_intervention(plan.loop, run)
    robot, policy = plan.loop.robot, plan.loop.policy
    observation, _ = robot.reset(seed=100, options={"start": "split"})
    outputs, shifts = plan.outputs(plan.tasked[0]), []
    policy.reset()
    for _ in range(36):
        acted = policy.act(observation, outputs)
        shifts.append(acted.action - policy.act(observation).action)
        observation, *_ = robot.step(acted.action)
    assert found.size is not None
    assert found.size.action == pytest.approx(np.mean(shifts, axis=0), abs=1e-6)


UNWIND = """
[[behaviors]]
name = "unwind"
key = "u"
magnitudes = { "0:0" = -0.5 }
task = "unwind"
"""


@pytest.mark.parametrize(("push", "runs"), [(0.5, 8), (0.01, 0)])
def test_what_is_needed_after_a_task_is_judged_after_it(push: float, runs: int) -> None:
    def judge_unwinding(trace: TaskRunTrace) -> TaskVerdict:
        turned, begins_turned = float(trace["yaw"][-1] - trace["yaw"][0]), trace.before("yaw")[-1] > 0.2
        return TaskVerdict(turned < -0.2 and begins_turned, -turned, {})

    class Unwinding(Vehicle):
        tasks = (*_Veering.tasks, Task("unwind", "u", "", "", (10, 20), 50, judge_unwinding, follows="veer"))

    text = MAP[: MAP.rindex("[[behaviors]]")].replace('"0:0" = 0.5', f'"0:0" = {push}') + UNWIND
    loop = ControlLoop(Unwinding(), turning_loop().policy, parse_map(text, "test"), 0)
    few = replace(SMALL, draws=0, condition_seeds=0)
    plan = EvaluationPlan(loop, range(100, 108), few)
    rows = evaluate_behaviors(DriveConfig("vehicle", loop.map, 0), plan).tasks
    (after,) = [row for row in rows if row.after]
    alone = next(row for row in rows if row.behavior == "unwind" and not row.after)
    assert (after.behavior, after.after, after.runs) == ("unwind", "veer", runs)
    assert (after.done, after.by_itself) == (runs, 0)
    assert alone.done == 0  # without the veer before it, it does not begin turned
