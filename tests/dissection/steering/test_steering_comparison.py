from __future__ import annotations

import json

import numpy as np
import pytest
from rich.console import Console

from pdtui.core.units import Stimulation
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarize_dissection
from pdtui.dissection.steering.linear_probes import LinearProbe
from pdtui.dissection.steering.steering_candidates import (
    SteeringMethod,
    affine_candidates,
    direction_candidates,
    random_direction_candidates,
    unit_candidates,
)
from pdtui.dissection.steering.steering_comparison import compare_steering
from pdtui.dissection.steering.steering_results import SteeringComparison
from pdtui.dissection.steering.steering_summary import steering_tables, summarize_steering
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.intervention_rollout_plan import InterventionRolloutPlan
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.stimulated_rollout import RolloutPlan
from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors
from tests.compass_world import SPIN, TURN, UNITS, Compass, compass_policy

RATE = 1
LAYERS = (UNITS,)


def _probe(unit: int, column: int) -> LinearProbe:
    along = np.eye(UNITS)[unit]
    return LinearProbe(column, 0, along, 0.0, 0.9, along, 0.0, 0.5, 2.0)


@pytest.fixture(scope="module")
def comparison() -> SteeringComparison:
    """The unit that spins the needle, one that turns it once, one that does nothing, and directions."""
    probe = _probe(SPIN, RATE)
    candidates = [
        *unit_candidates(SteeringMethod.PROBED_UNIT, RATE, [SPIN, TURN], (-4.0, -2.0, 2.0, 4.0), LAYERS),
        *unit_candidates(SteeringMethod.MATCHED_UNIT, RATE, [0], (-2.0, 2.0), LAYERS),
        *unit_candidates(SteeringMethod.RANDOM_UNIT, None, [1, 2], (-2.0, 2.0), LAYERS),
        *direction_candidates(probe, (-1.0, 1.0)),
        *affine_candidates(probe, (-2.0, 2.0)),
        *random_direction_candidates(0, UNITS, 2.0, 2, (-1.0, 1.0), np.random.default_rng(0)),
    ]
    with RolloutPool(Compass(), compass_policy(), 1) as pool:
        starts = collect_start_states(pool.robot, pool.policy, 1000, 14, at=5)
        return compare_steering(
            EffectProbe(pool),
            [RATE],
            np.array([0.1, 0.1]),
            candidates,
            [probe],
            starts[:3],
            starts[3:],
            40,
            0.05,
        )


@pytest.mark.parametrize("sign", [1, -1])
def test_the_unit_that_spins_steers_and_one_that_does_nothing_does_not(
    comparison: SteeringComparison, sign: int
) -> None:
    found = comparison.result_of(RATE, sign, SteeringMethod.PROBED_UNIT)
    assert found is not None
    assert found.beats_baseline
    assert found.candidate.source == f"0:{SPIN}"
    assert sign * found.measured.low > 0
    idle = comparison.result_of(RATE, sign, SteeringMethod.MATCHED_UNIT)
    assert idle is None or not idle.beats_baseline


def test_adding_along_the_probe_and_setting_its_reading_steer_and_random_directions_hardly_do(
    comparison: SteeringComparison,
) -> None:
    for method in (SteeringMethod.DIRECTION, SteeringMethod.AFFINE):
        found = comparison.result_of(RATE, 1, method)
        assert found is not None
        assert found.beats_baseline
        assert found.main > 0
    drawn = comparison.result_of(RATE, 1, SteeringMethod.RANDOM_DIRECTION)
    along = comparison.result_of(RATE, 1, SteeringMethod.DIRECTION)
    assert along is not None
    assert drawn is None or drawn.main < 0.5 * along.main


def test_a_reading_is_set_to_what_the_dose_says() -> None:
    probe = _probe(SPIN, RATE)
    (one,) = affine_candidates(probe, (2.0,))
    with RolloutPool(Compass(), compass_policy(), 1) as pool:
        start = collect_start_states(pool.robot, pool.policy, 1000, 1, at=5)[0]
        pool.robot.restore(start.snapshot)
        assert isinstance(one.plan, InterventionRolloutPlan)
        stimulation = one.plan.bind(pool.robot, pool.policy)(0, pool.robot.read_attributes())
        acted = pool.policy.act(pool.robot.observe(), stimulation)
    # Twice the deviation of 0.5 above the mean of 0.
    assert acted.activations[SPIN] == pytest.approx(1.0, abs=1e-5)


def test_the_smallest_dose_that_is_enough_is_taken_and_the_largest_safe_one_is_told() -> None:
    """A tanh unit's effect grows with its output: 4 does twice what 2 does, and 5 hardly more than 4."""
    candidates = unit_candidates(SteeringMethod.PROBED_UNIT, RATE, [SPIN], (1.0, 4.0, 5.0), LAYERS)
    with RolloutPool(Compass(), compass_policy(), 1) as pool:
        starts = collect_start_states(pool.robot, pool.policy, 1000, 8, at=5)
        result = compare_steering(
            EffectProbe(pool), [RATE], np.array([0.1, 0.1]), candidates, [], starts[:2], starts[2:], 20, 0.05
        )
    up = [one for one in result.results if one.candidate.dose > 0]
    assert [one.candidate.dose for one in up] == [4.0]
    assert up[0].largest_dose == 5.0


def test_plans_that_differ_only_in_their_vectors_are_told_apart() -> None:
    rows = np.eye(3, dtype=np.float32)
    intervention = Intervention("direction", vectors="along", coordinates=(1.0,))
    texts = {
        repr(InterventionRolloutPlan(intervention, (LayerVectors("along", "0", rows[[number]]),)))
        for number in range(3)
    }
    assert len(texts) == 3
    again = InterventionRolloutPlan(intervention, (LayerVectors("along", "0", rows[[0]].copy()),))
    assert repr(again) in texts


def test_an_intervention_of_a_roll_out_does_what_the_same_stimulation_does() -> None:
    with RolloutPool(Compass(), compass_policy(), 1) as pool:
        starts = collect_start_states(pool.robot, pool.policy, 1000, 2, at=5)
        plans: list[RolloutPlan] = [
            Stimulation((SPIN,), (2.0,)),
            InterventionRolloutPlan(Intervention("overwrite", values={f"0:{SPIN}": 2.0})),
        ]
        result = EffectProbe(pool).measure_plans(plans, starts, steps=20)
    np.testing.assert_array_equal(result.effects[0], result.effects[1])
    assert np.abs(result.effects[0, :, RATE]).min() > 0.01


def test_a_dissection_reports_every_way_and_its_tables_fit_a_terminal(dissection: Dissection) -> None:
    summary = json.loads(json.dumps(summarize_dissection(dissection), allow_nan=False))["steering"]
    assert summary == json.loads(
        json.dumps(summarize_steering(dissection.steering, dissection.attributes), allow_nan=False)
    )
    names = {one["method"] for one in summary["methods"]}
    assert {"matched unit", "direction", "imprint", "random unit", "random direction"} <= names
    assert set(summary["probes"]) == set(summary["attributes"])
    console = Console(width=80, record=True, file=open("/dev/null", "w"))  # noqa: SIM115, PTH123
    for table in steering_tables(summary):
        console.print(table)
    assert all(len(line) <= 80 for line in console.export_text().splitlines())
