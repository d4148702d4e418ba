"""Beginning a run of PPO from a trained policy, for a robot that observes what it did and more."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import TrainingError
from pdtui.policies.weights.policy_network import PolicyNetwork
from pdtui.training.jax_mlp import MlpParameters
from pdtui.training.ppo import PpoLearner, PpoState

_LEAST_DEVIATION = 0.01


def actor_of(network: PolicyNetwork) -> MlpParameters:
    """The network's layers on raw observations, as `PpoLearner.folded_actor` gives them."""
    layers = [*network.hidden, network.head]
    return [
        {"w": jnp.asarray(layer.weight.detach().numpy().T), "b": jnp.asarray(layer.bias.detach().numpy())}
        for layer in layers
    ]


def graft_policy(
    learner: PpoLearner, state: PpoState, actor: MlpParameters, seen: NDArray[np.float32]
) -> PpoState:
    """An untrained state that acts as a trained policy does, and knows nothing of the values yet.

    Args:
        learner: of the run.
        state: untrained.
        actor: on raw observations, mean and log deviation; it observes the first columns of the run's.
        seen: raw observations on the policy's way, shape (T, observations); the normaliser is theirs.

    Raises:
        TrainingError: the policy has other layers or actions, or observes more.
    """
    mine, theirs = ([layer["w"].shape for layer in layers] for layers in (state.actor, actor))
    observed, actions = theirs[0][0], mine[-1][1]
    if mine[1:-1] != theirs[1:-1] or mine[0][1] != theirs[0][1] or theirs[-1][1] != 2 * actions:
        raise TrainingError(f"expected a policy of layers {mine}, found {theirs}")
    if observed > learner.observations:
        raise TrainingError(f"expected a policy of at most {learner.observations} inputs, found {observed}")
    mean, deviation = seen.mean(axis=0), np.maximum(seen.std(axis=0), _LEAST_DEVIATION)
    weight = np.asarray(actor[0]["w"])
    scaled = np.zeros((learner.observations, weight.shape[1]), np.float32)
    scaled[:observed] = weight * deviation[:observed, None]
    head = actor[-1]
    layers = [
        {"w": jnp.asarray(scaled), "b": actor[0]["b"] + mean[:observed] @ weight},
        *actor[1:-1],
        {"w": head["w"][:, :actions], "b": head["b"][:actions]},
    ]
    return state._replace(
        actor=layers,
        average=[dict(layer) for layer in layers],
        log_std=head["b"][actions:],
        mean=jnp.asarray(mean),
        variance=jnp.asarray(deviation**2),
        rows_seen=jnp.asarray(float(len(seen))),
    )
