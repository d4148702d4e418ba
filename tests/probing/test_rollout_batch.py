"""Roll-outs in lock step measure what roll-outs one by one do."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.errors import PolicyError
from pdtui.core.units import Stimulation
from pdtui.policies.runtime.batched_policy import make_batched_policy
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.rollout_batch import run_rollouts
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.stimulated_rollout import PidStimulationPlan, RolloutJob, run_rollout
from pdtui.robots import make_robot
from pdtui.stimulation.stimulation_map import PidGains

# Relative deviation of a mean over 20 steps: float32 rounding, magnified by 30 steps of walking.
TOLERANCE = 1e-3


@pytest.mark.parametrize("name", ["anymal", "cassie"])
def test_outcomes_are_those_of_roll_outs_one_by_one(name: str) -> None:
    with make_robot(name) as robot:
        policy = load_policy(name, name)
        starts = dict(enumerate(collect_start_states(robot, policy, 2000, 2, at=30)))
        target = robot.attributes[0].name
        gains = PidGains(target, 1.0, 0.0, 0.0, 2.0, 0.1)
        controlled = PidStimulationPlan(Stimulation((4,), (1.0,)), gains, 0.5, relative=True)
        falling = Stimulation.of(dict.fromkeys(range(policy.units), 5.0))
        jobs: list[RolloutJob] = [
            *((Stimulation((unit,), (2.0,)), unit % 2) for unit in (0, 7, policy.units - 1)),
            (controlled, 0),
            (falling, 1),
            (Stimulation(), 0),
        ]
        together = run_rollouts(robot, policy, starts, jobs, 60, 40)
        for (plan, start), found in zip(jobs, together, strict=True):
            alone = run_rollout(robot, policy, starts[start], plan, 60, 40)
            assert (found.steps_survived, found.outcome) == (alone.steps_survived, alone.outcome)
            np.testing.assert_allclose(found.means, alone.means, rtol=TOLERANCE, atol=TOLERANCE)
            np.testing.assert_allclose(found.error, alone.error, rtol=TOLERANCE)
    assert together[4].outcome is not None, "nothing fell: the test shows nothing about falls"
    assert not np.allclose(together[0].means, together[5].means, rtol=TOLERANCE)


def test_a_batch_acts_like_the_policy_and_names_a_unit_that_does_not_exist() -> None:
    policy = load_policy("ant", "ant")
    batch = make_batched_policy(policy)
    assert batch is not None
    observations = np.random.default_rng(3).normal(size=(5, *policy.shape))
    stimulations = [Stimulation(), *(Stimulation((unit, 300), (3.0, -3.0)) for unit in (0, 8, 255, 299))]
    expected = [
        policy.act(observation, stimulation).action
        for observation, stimulation in zip(observations, stimulations, strict=True)
    ]
    np.testing.assert_allclose(batch.act(observations, stimulations), expected, atol=1e-5)
    with pytest.raises(PolicyError, match="unit number 512 does not exist"):
        batch.act(observations[:1], [Stimulation((512,), (1.0,))])
