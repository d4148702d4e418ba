"""Where a robot can arrive, crash or leave the road, evaluations say so in these words."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO

import pytest
from rich.console import Console, RenderableType

from pdtui.core.outcome import Outcome
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import MapEvaluation, evaluate_behaviors
from pdtui.evaluation.behavior_tables import behavior_tables
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.evaluation_tables import policy_evaluation_table, tracking_table
from pdtui.evaluation.policy_evaluation import evaluate_policy
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.search.gains.step_response import StepResponseSummary
from pdtui.search.gains.tracking_summary import TrackingSummary
from tests.road import road_loop

SEEDS = range(100, 103)
SETTINGS = ProtocolSettings(
    first_press=5,
    presses=3,
    hold_steps=24,
    hold_seconds=0.0,
    window_seconds=0.5,
    draws=1,
    draw_seeds=1,
    condition_seeds=0,
)


def _text(table: RenderableType) -> str:
    console = Console(width=240, record=True, file=StringIO())
    console.print(table)
    return console.export_text()


@pytest.fixture(scope="module")
def result() -> MapEvaluation:
    loop = road_loop()
    return evaluate_behaviors(DriveConfig("road", loop.map, 0), EvaluationPlan(loop, SEEDS, SETTINGS))


def test_a_policy_that_arrives_stays_upright_and_arrives() -> None:
    alone = evaluate_policy(road_loop(), SEEDS)
    assert alone.outcomes == {"arrived": 3, "crashed": 0, "left the road": 0}
    assert "arrived 3 of 3" in _text(policy_evaluation_table(alone))
    early = evaluate_policy(road_loop(), SEEDS, steps=30)
    assert early.outcomes[Outcome.OUT_OF_TIME] == 3
    assert "arrived 0 of 3, out of time 3" in _text(policy_evaluation_table(early))


def test_behaviors_are_told_by_how_their_runs_end(result: MapEvaluation) -> None:
    left, right, brake = result.behaviors
    assert left.outcomes == {"arrived": 0, "crashed": 0, "left the road": 3}
    assert right.outcomes == {"arrived": 0, "crashed": 3, "left the road": 0}
    assert not any(brake.outcomes.values())
    assert left.default_outcomes == {"arrived": 3, "crashed": 0, "left the road": 0}
    assert left.judged == 0  # it left the road before the release
    assert [row.falls for row in result.measured_effects().values()] == [3, 3, 0]
    text = _text(behavior_tables(result))
    assert "failures by itself" in text
    assert "3/3 (left the road 3)" in text
    assert "0/3 (arrived 3)" in text
    assert "falls" not in text


def test_a_policy_that_fails_by_itself_is_said_to_be_weak(result: MapEvaluation) -> None:
    assert "the policy is weak" not in _text(behavior_tables(result))
    rows = tuple(replace(row, default_outcomes={Outcome.FELL: row.runs}) for row in result.behaviors)
    text = _text(behavior_tables(replace(result, behaviors=rows)))
    assert "Without a press, there are 3/3 falls by itself: the policy is weak" in text


def test_targets_are_held_beside_the_falls_without_control() -> None:
    fell = {Outcome.FELL: 2}
    tracking = TrackingSummary(
        behavior="hold heading",
        attribute="yaw",
        unit="rad",
        seeds=(100, 101),
        targets=(),
        error=0.5,
        low=0.4,
        high=0.6,
        settled=0.5,
        bias=0.4,
        responses=StepResponseSummary.of([]),
        outcomes=fell,
        default_error=0.5,
        default_outcomes=fell,
    )
    text = _text(tracking_table(tracking))
    assert "falls 2 of 2" in text
    assert "Without control: falls 2 of 2." in text
