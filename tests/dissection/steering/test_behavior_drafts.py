from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.draft_map import draft_map
from pdtui.dissection.steering.linear_probes import LinearProbe
from pdtui.dissection.steering.steering_candidates import (
    SteeringCandidate,
    affine_candidates,
    direction_candidates,
)
from pdtui.dissection.steering.steering_results import SteeringResult
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.stimulation.behavior_latch import BehaviorLatch
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import MeasuredEffect


def _result(column: int, candidate: SteeringCandidate, **changes: float | None) -> SteeringResult:
    measured = MeasuredEffect(0.3, 0.2, 0.4, 0, 8)
    found = SteeringResult(column, 1, candidate, measured, 1.5, 0.4, candidate.dose, 0.01, 0.01, 0.05)
    return replace(found, **changes)  # type: ignore[arg-type]


def _with_results(dissection: Dissection, *results: SteeringResult) -> Dissection:
    steering = replace(dissection.steering, results=results)
    return replace(dissection, attribute_movers=(), behaviors=(), controllers=(), steering=steering)


@pytest.fixture(scope="module")
def probe(dissection: Dissection) -> LinearProbe:
    found = dissection.steering.probe_of(dissection.movable[0])
    assert found is not None
    return found


def test_a_direction_that_steers_becomes_a_key_where_no_unit_was_confirmed(
    dissection: Dissection, probe: LinearProbe
) -> None:
    candidate = direction_candidates(probe, (0.5,))[0]
    text = draft_map(_with_results(dissection, _result(probe.column, candidate)))
    found = parse_map(text, "draft")
    name = f"{dissection.attributes[probe.column].name} up"
    (intervention,) = found.behaviors[name].interventions
    assert intervention.kind == "direction"
    assert intervention.coordinates == pytest.approx((0.5 * probe.layer_spread,))
    along = found.vectors[intervention.vectors].rows[0]
    np.testing.assert_allclose(along, probe.weights / np.linalg.norm(probe.weights), atol=1e-6)


def test_an_affine_edit_of_the_map_sets_the_reading_in_a_drive(
    dissection: Dissection, probe: LinearProbe, policy_file: Path
) -> None:
    candidates = affine_candidates(probe, (2.0,))
    if not candidates:
        pytest.fail("the probe of the first attribute reads nothing along its difference of means")
    found = parse_map(draft_map(_with_results(dissection, _result(probe.column, candidates[0]))), "draft")
    name = f"{dissection.attributes[probe.column].name} up"
    policy: Policy = load_policy(policy_file)
    robot = make_robot("ant")
    latch = BehaviorLatch(found, policy.layers, robot.attributes, robot.control_dt, robot.observation_edits)
    observation, _ = robot.reset(seed=3)
    latch.latch_behavior(name, robot.read_attributes())
    acted = policy.act(observation, latch.stimulate(robot.read_attributes()))
    first = sum(policy.layers[: probe.layer])
    outputs = acted.activations[first : first + policy.layers[probe.layer]].astype(np.float64)
    wanted = probe.mean + 2.0 * probe.deviation
    assert outputs @ probe.weights + probe.intercept == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("changes", [{"p": 0.2}, {"p_random": 0.2}, {"p_random": None}])
def test_what_does_not_steer_more_than_chance_gets_no_key(
    dissection: Dissection, probe: LinearProbe, changes: dict[str, float | None]
) -> None:
    result = _result(probe.column, direction_candidates(probe, (0.5,))[0], **changes)
    assert parse_map(draft_map(_with_results(dissection, result)), "draft").behaviors == {}


def test_what_makes_the_robot_fall_gets_no_key(dissection: Dissection, probe: LinearProbe) -> None:
    result = _result(probe.column, direction_candidates(probe, (0.5,))[0])
    fell = replace(result, measured=replace(result.measured, falls=1))
    assert parse_map(draft_map(_with_results(dissection, fell)), "draft").behaviors == {}
