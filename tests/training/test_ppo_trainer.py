"""A run that begins from a trained policy first acts as that policy does."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
import torch

from pdtui.core.errors import TrainingError
from pdtui.policies.runtime.jax_multilayer_perceptron import network_to_mlp_parameters
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.training.actor_conversion import actor_to_network, make_numpy_actor
from pdtui.training.ppo_learner import PpoLearner
from pdtui.training.ppo_trainer import warm_start_policy
from pdtui.training.training_config import PpoConfig


def _network(layers: tuple[int, ...] = (8, 6)) -> PolicyNetwork:
    torch.manual_seed(3)
    bounds = (-1.0, -1.0), (1.0, 1.0)
    return PolicyNetwork(NetworkSpec("x", 3, layers, "tanh", 2, "squashed_gaussian", *bounds))


def test_it_acts_the_same_whatever_the_new_inputs_are() -> None:
    learner, network = PpoLearner(PpoConfig(layers=(8, 6)), 5, 2), _network()
    seen = (np.random.default_rng(0).normal(size=(200, 5)) * [1, 20, 0.0, 3, 1] + 2).astype(np.float32)
    state = warm_start_policy(learner, learner.init(1), network_to_mlp_parameters(network), seen)
    mean = np.tanh(network(torch.from_numpy(seen[:, :3])).detach().numpy()[:, :2])
    assert np.abs(make_numpy_actor(learner.folded_actor(state), None)(seen) - mean).max() < 1e-4
    still = state._replace(log_std=jnp.full(2, -30.0))
    assert np.abs(np.tanh(learner.sample_actions(still, seen, np.random.default_rng(0))) - mean).max() < 1e-4
    spec = NetworkSpec("x", 5, (8, 6), "tanh", 2, "squashed_gaussian", (-1.0, -1.0), (1.0, 1.0))
    saved = actor_to_network(learner.folded_actor(state), spec)
    assert np.abs(np.tanh(saved(torch.from_numpy(seen)).detach().numpy()[:, :2]) - mean).max() < 1e-4


def test_it_refuses_a_policy_of_other_layers() -> None:
    learner = PpoLearner(PpoConfig(layers=(8, 6)), 5, 2)
    with pytest.raises(TrainingError, match="expected a policy of layers"):
        warm_start_policy(
            learner,
            learner.init(1),
            network_to_mlp_parameters(_network((8, 8))),
            np.zeros((4, 5), np.float32),
        )
