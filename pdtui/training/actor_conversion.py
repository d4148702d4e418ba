"""A trained actor as a function of NumPy and as a network that the policy runtime loads."""

from __future__ import annotations

from collections.abc import Callable

import jax
import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.policies.runtime.jax_multilayer_perceptron import ARRAY_ACTIVATIONS, MlpParameters, apply_mlp
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork

Actor = Callable[[NDArray[np.float32]], NDArray[np.float32]]


def make_numpy_actor(
    params: MlpParameters, rng: np.random.Generator | None, activation: str = "tanh"
) -> Actor:
    """Return a squashed Gaussian actor in NumPy: its mean actions, or samples where a generator is given."""
    params, activate = jax.tree.map(np.asarray, params), ARRAY_ACTIVATIONS[activation][1]

    def act(observation: NDArray[np.float32]) -> NDArray[np.float32]:
        mean, log_std = np.split(apply_mlp(params, observation, activate), 2, axis=-1)
        if rng is not None:
            noise = rng.standard_normal(mean.shape, np.float32)
            mean = mean + np.exp(np.clip(log_std, -5.0, 2.0)) * noise
        action: NDArray[np.float32] = np.tanh(mean)
        return action

    return act


def actor_to_network(params: MlpParameters, spec: NetworkSpec) -> PolicyNetwork:
    """Return the actor as the network that the policy runtime loads."""
    network = PolicyNetwork(spec)
    tensors = dict(network.state_dict())
    for index, layer in enumerate(params):
        name = "head" if index == len(params) - 1 else f"hidden.{index}"
        tensors[f"{name}.weight"] = torch.from_numpy(np.array(layer["w"]).T.copy())
        tensors[f"{name}.bias"] = torch.from_numpy(np.array(layer["b"]).copy())
    network.load_tensors(tensors)
    return network
