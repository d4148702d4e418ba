"""Strips of frames of the best, the median and the worst seed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from pdtui.core.errors import PictureError
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import MapEvaluation, evaluate_behaviors, plan_evaluation
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.held_run import HeldRunPlan, drive_held_run
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.evaluation.ranked_runs import rank_runs
from pdtui.pictures.behavior_strips import draw_strips, film_strips, frame_seconds
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.stimulation_map import StimulationMap

FEW = ProtocolSettings(
    first_press=10, presses=5, hold_steps=40, hold_seconds=0.0, window_seconds=1.0, draws=0, condition_seeds=0
)


@pytest.fixture(scope="module")
def plan(small_map: StimulationMap) -> EvaluationPlan:
    return plan_evaluation(DriveConfig("ant", small_map, 0), [100, 101, 102], FEW)


@pytest.fixture(scope="module")
def result(plan: EvaluationPlan, small_map: StimulationMap) -> MapEvaluation:
    return evaluate_behaviors(DriveConfig("ant", small_map, 0), plan)


def test_runs_that_meet_the_criterion_come_first(plan: EvaluationPlan, result: MapEvaluation) -> None:
    row = replace(result.behaviors[0], wanted=-1.0)
    row = replace(row, seed_met=(False, True, True), seed_effects=(-9.0, -1.0, -2.0))
    runs = rank_runs(plan, replace(result, behaviors=(row,)))
    assert [(run.rank, run.plan.seed, run.met) for run in runs] == [
        ("best", 102, True),
        ("median", 101, True),
        ("worst", 100, False),
    ]


def test_a_strip_shows_the_runs_that_were_judged(
    plan: EvaluationPlan, result: MapEvaluation, tmp_path: Path
) -> None:
    strips = film_strips(plan, rank_runs(plan, result))
    assert [strip.run.rank for strip in strips] == ["best", "median", "worst"]
    assert sorted(strip.run.plan.seed for strip in strips) == [100, 101, 102]
    best, times = strips[0], plan.times("push", strips[0].run.plan.seed)
    records = list(drive_held_run(plan.loop, HeldRunPlan("push", best.run.plan.seed, times)))
    assert list(best.film.seconds) == frame_seconds(times)
    for seconds, poses in zip(best.film.seconds, best.film.poses, strict=True):
        assert np.array_equal(poses, records[times.press + round(seconds / times.dt)].poses)
    assert len(best.film.way) == times.held + times.after
    draw_strips(tmp_path / "strip.png", plan, strips)
    picture = imread(tmp_path / "strip.png")[..., :3]
    cells = np.array_split(picture[120:], len(strips[0].film.seconds) + 1, axis=1)
    assert all((cell.min(axis=2) < 0.9).sum() > 100 for cell in cells)  # each column shows something


def test_a_task_is_shown_from_its_own_start_for_as_long_as_its_judge_looks() -> None:
    config = DriveConfig("bipedal_walker", load_map(find_map("bipedal_walker")), 0)
    plan = plan_evaluation(config, [100, 101], FEW)
    runs = rank_runs(plan, evaluate_behaviors(config, plan))
    assert {run.behavior for run in runs} == set(plan.loop.map.behaviors)
    for run in runs:
        task = plan.loop.robot.find_task(plan.loop.map.behaviors[run.behavior].task)
        assert (run.plan.start, run.plan.times.held) == (task.start, task.steps)
    (strip,) = film_strips(plan, [run for run in runs if run.behavior == "jump"][:1])
    assert len(strip.film.seconds) == 8
    assert strip.film.seconds[-1] == pytest.approx(
        (strip.run.plan.times.held - 1) * plan.loop.robot.control_dt
    )


def test_a_map_without_aims_and_tasks_has_no_strip(plan: EvaluationPlan) -> None:
    with pytest.raises(PictureError, match="ant: no behavior with an aim or a task"):
        film_strips(plan, [])
