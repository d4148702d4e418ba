"""Where a robot can arrive, crash or leave the road, evaluations say so in these words."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console, RenderableType

from pdtui.core.outcome import Outcome
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import MapEvaluation, evaluate_behaviors
from pdtui.evaluation.behavior_tables import behavior_tables
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.evaluation_tables import policy_evaluation_table
from pdtui.evaluation.policy_evaluation import evaluate_policy
from pdtui.evaluation.protocol_settings import ProtocolSettings
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
