"""An untrained actor is fitted to what somebody does."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pdtui.core.errors import TrainingError
from tests.turning_robot import Vehicle

pytest.importorskip("jax", reason="the extra 'train' is not installed")

import jax.numpy as jnp

from pdtui.training.actor_conversion import make_numpy_actor
from pdtui.training.policy_imitation import fit_actor, fit_gaussian_actor
from pdtui.training.ppo_learner import PpoLearner
from pdtui.training.robot_batch import RobotBatch
from pdtui.training.sac_learner import SacLearner, run_actor
from pdtui.training.training_config import PpoConfig, SacConfig


def _demonstrate(rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    seen = rng.uniform(-1.0, 1.0, (3000, 3)).astype(np.float32) * np.array([1.0, 10.0, 0.1], np.float32)
    actions = np.stack([np.sin(seen[:, 0]), 0.05 * seen[:, 1] * seen[:, 2]], axis=-1)
    return seen, actions.astype(np.float32)


@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_a_fitted_actor_does_what_it_was_shown(activation: str) -> None:
    rng = np.random.default_rng(0)
    seen, actions = _demonstrate(rng)
    learner = PpoLearner(PpoConfig(layers=(32, 32), activation=activation), 3, 2)
    state, error = fit_actor(learner, learner.init(1), seen, actions, rng)
    acted = make_numpy_actor(learner.folded_actor(state), None, activation)(seen)
    assert error < 0.05
    assert np.sqrt(((acted - actions) ** 2).mean()) < 0.05


def test_a_fitted_actor_of_sac_does_it_with_the_given_deviation() -> None:
    rng = np.random.default_rng(0)
    seen, actions = _demonstrate(rng)
    untrained = SacLearner(SacConfig(layers=(32, 32)), 3, 2).init(1).actor
    actor, error = fit_gaussian_actor(untrained, seen, actions, -2.4, rng)
    mean, log_std = run_actor(actor, jnp.asarray(seen))
    assert error < 0.05
    assert np.sqrt(((np.tanh(mean) - actions) ** 2).mean()) < 0.05
    np.testing.assert_allclose(log_std, -2.4, atol=1e-6)


def test_a_robot_without_rules_cannot_be_imitated() -> None:
    with pytest.raises(TrainingError, match="expected a robot with a rule-based driver"):
        RobotBatch(Vehicle, 1, 0).suggest_actions()
