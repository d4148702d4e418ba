"""Onsets of the Walker's brake: a search waits as an evaluation does, and the phase decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.units import Stimulation, parse_unit
from pdtui.driving.control_loop import ControlLoop
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.held_run import InterventionMeasurement
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.evaluation.tasks.task_runs import TaskRunKey, plan_task_episode, run_task_episode
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots import make_robot
from pdtui.robots.task import TaskVerdict
from pdtui.search.onsets.onset_search import search_onset
from pdtui.search.task_rollout import StimulationWithDuration, judge_stimulations
from pdtui.stimulation.interventions.gait_clock import GaitMark
from pdtui.stimulation.interventions.intervention import Onset
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map

FOOT_UP = GaitMark("left foot clearance", "up", 0.04, 0.35)


@pytest.fixture(scope="module")
def policy() -> Policy:
    return load_policy("walker")


@pytest.fixture(scope="module")
def brake(policy: Policy) -> StimulationWithDuration:
    found = load_map(find_map("walker"))
    (behavior,) = found.behaviors.values()
    units = {parse_unit(unit, policy.layers): value for unit, value in found.units_of(behavior).items()}
    return StimulationWithDuration(Stimulation.of(units))


def test_a_search_judges_an_armed_behavior_as_an_evaluation_does(
    policy: Policy, brake: StimulationWithDuration
) -> None:
    onset = Onset(FOOT_UP, 0.2)
    shipped = load_map(find_map("walker"))
    (behavior,) = shipped.behaviors.values()
    waiting = replace(shipped, behaviors={behavior.name: replace(behavior, onset=onset)})
    robot = make_robot("walker")
    plan = EvaluationPlan(
        ControlLoop(robot, policy, waiting, 0), range(100, 103), ProtocolSettings(hold_steps=100)
    )
    task, figures = robot.find_task(behavior.task), []
    measured = {"": [InterventionMeasurement(None, np.zeros(17))]}
    for seed in (100, 101):
        episode = plan_task_episode(plan, TaskRunKey(behavior.name, seed, True, task.steps), measured)
        assert episode is not None
        evaluated = run_task_episode(plan.loop, episode).verdict
        (searched,) = judge_stimulations(robot, policy, task, [replace(brake, onset=onset)], seed)
        assert searched == evaluated
        figures.append(searched.figures)
    (at_once,) = judge_stimulations(robot, policy, task, [brake], 101)
    assert at_once.figures not in figures


def test_one_that_never_begins_is_not_done(policy: Policy, brake: StimulationWithDuration) -> None:
    robot = make_robot("walker")
    never = Onset(GaitMark("height", "up", 5.0))
    (verdict,) = judge_stimulations(
        robot, policy, robot.find_task("slow down"), [replace(brake, onset=never)], 100
    )
    assert (verdict.success, verdict.score) == (False, 0.0)


def test_the_best_phase_is_taken_if_it_does_better_on_fresh_walks(brake: StimulationWithDuration) -> None:
    """The verdicts are made up: only from 0.3 s after some moment on, for a quarter of a second, it works."""
    seeds, fresh, asked = range(20_000, 20_003), range(21_000, 21_004), []

    def judge(plans: Sequence[StimulationWithDuration], on: Sequence[int]) -> list[list[TaskVerdict]]:
        asked.append((len(plans), on))
        works = [one.onset is not None and 0.25 < one.onset.delay < 0.5 for one in plans]
        return [[TaskVerdict(done, float(done), {}) for _ in on] for done in works]

    def judge_otherwise_later(
        plans: Sequence[StimulationWithDuration], on: Sequence[int]
    ) -> list[list[TaskVerdict]]:
        rows = judge(plans, on)
        return rows if on == seeds else rows[::-1]

    with RolloutPool("walker", "walker", 1) as pool:
        found = search_onset(pool, brake, seeds, fresh, judge)
        assert found.onset is not None
        assert 0.25 < found.onset.delay < 0.5
        assert [on for _, on in asked] == [seeds, fresh]
        assert asked[1][0] == 2
        assert search_onset(pool, brake, seeds, fresh, judge_otherwise_later) == brake


@pytest.mark.slow
def test_the_walker_brakes_far_oftener_at_the_right_phase(
    policy: Policy, brake: StimulationWithDuration
) -> None:
    robot = make_robot("walker")
    plans = [replace(brake, onset=Onset(FOOT_UP, delay)) for delay in np.arange(0.0, 0.56, 0.07).round(3)]
    rows = [
        judge_stimulations(robot, policy, robot.find_task("slow down"), plans, seed)
        for seed in range(20_000, 20_012)
    ]
    done = np.array([[verdict.success for verdict in row] for row in rows]).sum(axis=0)
    assert done.max() >= 11
    assert done.min() <= 2
