"""An untrained policy that learns by least squares to act as another policy, or a rule-based driver, does."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from pdtui.training.multilayer_perceptron import MlpParameters, apply_mlp
from pdtui.training.ppo_learner import PpoLearner, PpoState, normalise_observations

_EPOCHS, _BATCH, _LEARNING_RATE = 60, 256, 1e-3


def fit_actor(
    learner: PpoLearner,
    state: PpoState,
    seen: NDArray[np.float32],
    actions: NDArray[np.float32],
    rng: np.random.Generator,
) -> tuple[PpoState, float]:
    """Fit the actor of an untrained state to what somebody did.

    Args:
        learner: Learner of the run.
        state: Untrained state.
        seen: Raw observations, shape (T, observations).
        actions: The actions to take there, in [−1, 1], shape (T, actions).
        rng: Draws the order of the samples.

    Returns:
        The state, and the root mean square of the actor's errors on the last tenth of the observations,
        which it was not fitted to.
    """
    mean, variance = jnp.asarray(seen.mean(axis=0)), jnp.asarray(seen.var(axis=0))
    state = state._replace(mean=mean, variance=variance, rows_seen=jnp.asarray(float(len(seen))))
    inputs = normalise_observations(state, jnp.asarray(seen), learner.config.least_deviation)
    goals, fitted = jnp.asarray(actions), int(0.9 * len(seen))
    optimiser = optax.adam(_LEARNING_RATE)

    def error(actor: MlpParameters, rows: jax.Array) -> jax.Array:
        acted = jnp.tanh(apply_mlp(actor, inputs[rows], learner.activate))
        total: jax.Array = ((acted - goals[rows]) ** 2).mean()
        return total

    def step(carry: tuple[MlpParameters, Any], rows: jax.Array) -> tuple[tuple[MlpParameters, Any], None]:
        actor, kept = carry
        changes, kept = optimiser.update(jax.grad(error)(actor, rows), kept)
        return (optax.apply_updates(actor, changes), kept), None

    scan = jax.jit(lambda carry, batches: jax.lax.scan(step, carry, batches)[0])
    carry = (state.actor, optimiser.init(state.actor))
    for _ in range(_EPOCHS):
        order = rng.permutation(fitted)[: fitted // _BATCH * _BATCH]
        carry = scan(carry, jnp.asarray(order.reshape(-1, _BATCH)))
    actor = carry[0]
    left = float(jnp.sqrt(error(actor, jnp.arange(fitted, len(seen)))))
    return state._replace(actor=actor, average=jax.tree.map(jnp.copy, actor)), left
