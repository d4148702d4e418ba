"""An untrained policy that learns by least squares to act as another policy, or a rule-based driver, does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from pdtui.policies.runtime.jax_multilayer_perceptron import (
    MlpParameters,
    apply_mlp,
    network_to_mlp_parameters,
)
from pdtui.policies.weights.policy_network import PolicyNetwork
from pdtui.training.actor_conversion import Actor, make_numpy_actor
from pdtui.training.ppo_learner import PpoLearner, PpoState, normalize_observations

_EPOCHS, _BATCH, _LEARNING_RATE = 60, 256, 1e-3
# Control steps of every robot in each round of imitation, and the deviation of the noise on the actions.
_ROUND_STEPS, _ROUND_NOISE = 500, 0.08
# A smaller deviation than this would blow up inputs that hardly change.
_LEAST_DEVIATION = 0.1


def imitate(
    observe: Callable[[], NDArray[np.float32]],
    step: Callable[[NDArray[np.float32]], object],
    demonstrate: Actor,
    fit: Callable[[NDArray[np.float32], NDArray[np.float32]], Actor],
    rounds: int,
    rng: np.random.Generator,
) -> None:
    """Learn to act as somebody does, in several rounds.

    After the first round the learner acts itself, so that it is told what to do where it goes astray
    (Ross et al., "A Reduction of Imitation Learning and Structured Prediction to No-Regret Online
    Learning", 2011).

    Args:
        observe: Returns what the robots observe now, shape (robots, observations).
        step: Steps them with actions in [−1, 1], shape (robots, actions).
        demonstrate: Returns the actions to take, given observations.
        fit: Fits an untrained actor to all that was seen and the actions to take there, and returns it.
        rounds: Number of rounds.
        rng: Draws the noise on the actions.
    """
    seen: list[NDArray[np.float32]] = []
    actions: list[NDArray[np.float32]] = []
    act = demonstrate
    for number in range(rounds):
        for _ in range(_ROUND_STEPS):
            seen.append(observe())
            actions.append(demonstrate(seen[-1]))
            noise = rng.normal(0.0, _ROUND_NOISE, actions[-1].shape).astype(np.float32)
            step(np.clip((act(seen[-1]) if number else actions[-1]) + noise, -1.0, 1.0))
        act = fit(np.concatenate(seen), np.concatenate(actions))


def make_demonstrator(network: PolicyNetwork) -> Actor:
    """Return what a policy does, given what a run observes: it observes the first columns of that."""
    actor = network_to_mlp_parameters(network)
    act, inputs = make_numpy_actor(actor, None, network.spec.activation), actor[0]["w"].shape[0]
    return lambda seen: act(seen[:, :inputs])


def fit_actor(
    learner: PpoLearner,
    state: PpoState,
    seen: NDArray[np.float32],
    actions: NDArray[np.float32],
    rng: np.random.Generator,
) -> tuple[PpoState, float]:
    """Fit the actor of an untrained state of PPO to what somebody did.

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
    inputs = normalize_observations(state, jnp.asarray(seen), learner.config.least_deviation)
    actor, left = _fit_layers(state.actor, inputs, jnp.asarray(actions), learner.activate, rng)
    return state._replace(actor=actor, average=jax.tree.map(jnp.copy, actor)), left


def fit_gaussian_actor(
    actor: MlpParameters,
    seen: NDArray[np.float32],
    actions: NDArray[np.float32],
    log_std: float,
    rng: np.random.Generator,
) -> tuple[MlpParameters, float]:
    """Fit an untrained tanh actor of SAC, whose outputs are means and log deviations, to what somebody did.

    Args:
        actor: Untrained actor on raw observations.
        seen: Raw observations, shape (T, observations).
        actions: The actions to take there, in [−1, 1], shape (T, actions).
        log_std: The log deviation that it is given everywhere.
        rng: Draws the order of the samples.

    Returns:
        The actor on raw observations, and the root mean square of its errors, as `fit_actor` returns it.
    """
    count = actions.shape[1]
    mean, deviation = seen.mean(axis=0), np.maximum(seen.std(axis=0), _LEAST_DEVIATION)
    head = jax.tree.map(lambda leaf: leaf[..., :count], actor[-1])
    inputs = jnp.asarray((seen - mean) / deviation)
    fitted, left = _fit_layers([*actor[:-1], head], inputs, jnp.asarray(actions), jnp.tanh, rng)
    weight, head = fitted[0]["w"] / deviation[:, None], fitted[-1]
    first = {"w": weight, "b": fitted[0]["b"] - mean @ weight}
    last = {
        "w": jnp.concatenate([head["w"], jnp.zeros_like(head["w"])], axis=1),
        "b": jnp.concatenate([head["b"], jnp.full(count, log_std)]),
    }
    return [first, *fitted[1:-1], last], left


def _fit_layers(
    actor: MlpParameters,
    inputs: jax.Array,
    goals: jax.Array,
    activate: Callable[[Any], Any],
    rng: np.random.Generator,
) -> tuple[MlpParameters, float]:
    """Fit layers whose outputs are squashed by tanh; also returns the error on the last tenth of the rows."""
    fitted = int(0.9 * len(inputs))
    optimizer = optax.adam(_LEARNING_RATE)

    def error(actor: MlpParameters, rows: jax.Array) -> jax.Array:
        acted = jnp.tanh(apply_mlp(actor, inputs[rows], activate))
        total: jax.Array = ((acted - goals[rows]) ** 2).mean()
        return total

    def step(carry: tuple[MlpParameters, Any], rows: jax.Array) -> tuple[tuple[MlpParameters, Any], None]:
        actor, kept = carry
        changes, kept = optimizer.update(jax.grad(error)(actor, rows), kept)
        return (optax.apply_updates(actor, changes), kept), None

    scan = jax.jit(lambda carry, batches: jax.lax.scan(step, carry, batches)[0])
    carry = (actor, optimizer.init(actor))
    for _ in range(_EPOCHS):
        order = rng.permutation(fitted)[: fitted // _BATCH * _BATCH]
        carry = scan(carry, jnp.asarray(order.reshape(-1, _BATCH)))
    left = float(jnp.sqrt(error(carry[0], jnp.arange(fitted, len(inputs)))))
    return carry[0], left
