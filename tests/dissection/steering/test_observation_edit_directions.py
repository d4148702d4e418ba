"""Directions of edits: what they are, and that the shipped ones are what the guide says that they are."""

from __future__ import annotations

import numpy as np
import pytest

import pdtui
from pdtui.core.errors import RobotError
from pdtui.dissection.steering.observation_edit_directions import fit_edit_direction, sample_walk_observations
from pdtui.dissection.steering.steering_candidates import edit_direction_candidates
from pdtui.probing.intervention_rollout_plan import InterventionRolloutPlan
from pdtui.robots import make_robot
from pdtui.robots.observation_edits.observation_edit import offset_observed_number
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map
from tests.compass_world import Compass, compass_policy

EDIT = offset_observed_number(0, "offset", "rad", "it is turned by this much")


def test_a_direction_is_half_the_mean_difference_of_the_outputs() -> None:
    policy = compass_policy()
    observations = sample_walk_observations(Compass(), policy, 1000, steps=120)
    assert len(observations) == 5  # those before the hundredth control step are left out
    direction = fit_edit_direction(policy, observations, [EDIT], {"offset": 0.5})
    up, down = (
        np.mean([policy.act(EDIT.apply(one, size)).activations for one in observations], axis=0)
        for size in (0.5, -0.5)
    )
    np.testing.assert_allclose(direction.change, (up - down) / 2, atol=1e-6)
    assert 0.0 < direction.common <= 1.0
    added = direction.make_intervention("along", 2.0)
    (length,), vectors = added.coordinates, direction.make_layer_vectors("along")
    np.testing.assert_allclose(length * vectors.rows[0], 2.0 * direction.change, atol=1e-5)


def test_an_edit_that_the_robot_does_not_offer_is_named() -> None:
    with pytest.raises(RobotError, match="no edit 'lift' of the observation; available: offset"):
        fit_edit_direction(compass_policy(), [np.zeros(2)], [EDIT], {"lift": 1.0})


def test_a_candidate_adds_what_the_edit_of_its_size_changes() -> None:
    policy = compass_policy()
    observations = sample_walk_observations(Compass(), policy, 1000, steps=120)
    direction = fit_edit_direction(policy, observations, [EDIT], {"offset": 0.2})
    one, other = edit_direction_candidates([EDIT], {"offset": direction}, (1.0, -2.0))
    assert one.source == other.source == "offset"
    assert [one.dose, other.dose] == pytest.approx([0.2, -0.4])
    assert isinstance(other.plan, InterventionRolloutPlan)
    assert list(other.plan.intervention.coordinates) == pytest.approx([-2.0 * direction.length])


@pytest.mark.parametrize(
    ("shipped", "vectors", "sizes"),
    [
        ("anymal", "turning", {"yaw rate command": 2.0}),
        ("anymal-forward-directions", "turning left", {"yaw rate offset": -2.0}),
        ("anymal-forward-directions", "turning right", {"yaw rate offset": 2.0, "forward offset": 1.0 / 3.0}),
        ("anymal-forward-directions", "moving left", {"sideways offset": -0.5}),
    ],
)
def test_the_shipped_directions_are_those_of_the_edits_that_the_maps_name(
    shipped: str, vectors: str, sizes: dict[str, float]
) -> None:
    own = load_map(find_map(shipped))
    robot, policy = make_robot(own.robot), pdtui.load_policy(own.policy)
    observations = sample_walk_observations(robot, policy, 1000)
    direction = fit_edit_direction(policy, observations, robot.observation_edits, sizes)
    np.testing.assert_allclose(
        direction.make_layer_vectors(vectors).rows, own.vectors[vectors].rows, atol=1e-3
    )
