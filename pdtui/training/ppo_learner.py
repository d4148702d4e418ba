"""The learner of Proximal Policy Optimization, compiled by JAX.

It follows Schulman et al., "Proximal Policy Optimization Algorithms" (2017): a clipped surrogate, generalized
advantages, and a learning rate that adapts to the divergence between updates. The policy is a Gaussian
squashed by tanh, as in SAC, so that both algorithms end in the same network. The squashing is the same before
and after an update, so probability ratios are those of the Gaussians.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from pdtui.policies.runtime.jax_multilayer_perceptron import (
    ARRAY_ACTIVATIONS,
    MlpParameters,
    apply_mlp,
    init_mlp_parameters,
)
from pdtui.training.training_config import PpoConfig

_EPSILON = 1e-8
# Rows after which the running mean and variance stop slowing down, so that they follow the policy.
_MAX_ROWS_SEEN = 2_000_000.0
# Bounds of the learning rate and its factor per gradient step when the divergence is off by a factor of 2.
_MIN_RATE, _MAX_RATE, _RATE_FACTOR = 1e-6, 2e-3, 1.05
_MIN_LOG_STD, _MAX_LOG_STD = -3.0, 0.5


class PpoState(NamedTuple):
    """Everything that learning changes, as a tree of arrays.

    `mean`, `variance` and `rows_seen` normalize observations; `average` is the moving average of the actor.
    """

    actor: MlpParameters
    log_std: jax.Array
    critic: MlpParameters
    optimizer: Any
    rate: jax.Array
    key: jax.Array
    mean: jax.Array
    variance: jax.Array
    rows_seen: jax.Array
    iterations: jax.Array
    average: MlpParameters


class PpoRollout(NamedTuple):
    """Collected steps, leading axes (steps, worlds); observations are raw, actions are before tanh."""

    observation: Any
    action: Any
    reward: Any
    discount: Any
    following: Any
    restarted: Any


class _Sample(NamedTuple):
    observation: jax.Array
    action: jax.Array
    log_prob: jax.Array
    advantage: jax.Array
    value_goal: jax.Array


def normalize_observations(state: PpoState, observation: jax.Array, least_deviation: float) -> jax.Array:
    """Return observations normalized by the running mean and deviation."""
    return (observation - state.mean) / _deviation(state, least_deviation)


def _deviation(state: PpoState, least: float) -> jax.Array:
    return jnp.sqrt(jnp.maximum(state.variance, least**2) + _EPSILON)


def _log_prob(mean: jax.Array, log_std: jax.Array, action: jax.Array) -> jax.Array:
    return (-0.5 * ((action - mean) / jnp.exp(log_std)) ** 2 - log_std).sum(-1)


class PpoLearner:
    """Makes the untrained state and the compiled `update`."""

    def __init__(self, config: PpoConfig, observations: int, actions: int) -> None:
        self.config, self.observations, self.actions = config, observations, actions
        self.activate, self._activate_in_numpy = ARRAY_ACTIVATIONS[config.activation]
        self._tx = optax.chain(optax.clip_by_global_norm(1.0), optax.scale_by_adam())
        self.update = jax.jit(self._update)

    def init(self, seed: int) -> PpoState:
        """Return the untrained state."""
        config = self.config
        key, actor_key, critic_key = jax.random.split(jax.random.PRNGKey(seed), 3)
        actor = init_mlp_parameters(actor_key, (self.observations, *config.layers, self.actions), False)
        actor[-1] = jax.tree.map(lambda leaf: 0.01 * leaf, actor[-1])
        critic = init_mlp_parameters(critic_key, (self.observations, *config.layers, 1), False)
        log_std = jnp.full(self.actions, config.log_std)
        optimizer, rate = self._tx.init((actor, log_std, critic)), jnp.asarray(config.learning_rate)
        mean, variance, rows_seen = jnp.zeros(self.observations), jnp.ones(self.observations), 1e-4
        seen = (mean, variance, jnp.asarray(rows_seen), jnp.zeros(()), jax.tree.map(jnp.copy, actor))
        return PpoState(actor, log_std, critic, optimizer, rate, key, *seen)

    def folded_actor(self, state: PpoState) -> MlpParameters:
        """Return the averaged actor on raw observations, with log deviations as constant outputs."""
        first, *middle, last = state.average
        weight = first["w"] / _deviation(state, self.config.least_deviation)[:, None]
        head_weight = jnp.concatenate([last["w"], jnp.zeros_like(last["w"])], axis=1)
        head = {"w": head_weight, "b": jnp.concatenate([last["b"], state.log_std])}
        return [{"w": weight, "b": first["b"] - state.mean @ weight}, *middle, head]

    def _update(self, state: PpoState, rollout: PpoRollout) -> tuple[PpoState, jax.Array]:
        """Learn from a roll-out; also returns the mean divergence."""
        state = self._observe(state, rollout.observation.reshape(-1, self.observations))
        samples = self._samples(state, rollout)
        total = samples.advantage.shape[0]
        batches = total // self.config.minibatch

        def epoch(state: PpoState, _: None) -> tuple[PpoState, jax.Array]:
            key, order_key = jax.random.split(state.key)
            order = jax.random.permutation(order_key, total)[: batches * self.config.minibatch]
            shuffled = jax.tree.map(
                lambda leaf: leaf[order].reshape(batches, self.config.minibatch, *leaf.shape[1:]), samples
            )
            return jax.lax.scan(self._step, state._replace(key=key), shuffled)

        state, divergences = jax.lax.scan(epoch, state, None, length=self.config.epochs)
        return state._replace(iterations=state.iterations + 1), divergences.mean()

    def _observe(self, state: PpoState, rows: jax.Array) -> PpoState:
        """Merge a batch into the running mean and variance (Chan et al., 1979)."""
        mean, variance, count = rows.mean(0), rows.var(0), rows.shape[0]
        total = state.rows_seen + count
        delta = mean - state.mean
        merged = (
            state.variance * state.rows_seen + variance * count + delta**2 * state.rows_seen * count / total
        ) / total
        mean, rows_seen = state.mean + delta * count / total, jnp.minimum(total, _MAX_ROWS_SEEN)
        return state._replace(mean=mean, variance=merged, rows_seen=rows_seen)

    def _samples(self, state: PpoState, rollout: PpoRollout) -> _Sample:
        config = self.config
        observation = normalize_observations(state, rollout.observation, config.least_deviation)
        value = apply_mlp(state.critic, observation, self.activate)[..., 0]
        following = normalize_observations(state, rollout.following, config.least_deviation)
        future = apply_mlp(state.critic, following, self.activate)[..., 0]
        delta = rollout.reward * config.reward_scale + config.discount * rollout.discount * future - value

        def backwards(later: jax.Array, now: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
            error, restarted = now
            advantage = error + config.discount * config.gae * (1.0 - restarted) * later
            return advantage, advantage

        _, advantage = jax.lax.scan(
            backwards, jnp.zeros(delta.shape[1]), (delta, rollout.restarted), reverse=True
        )
        mean = apply_mlp(state.actor, observation, self.activate)

        scaled = (advantage - advantage.mean()) / (advantage.std() + _EPSILON)
        log_prob = _log_prob(mean, state.log_std, rollout.action)
        parts = (observation, rollout.action, log_prob, scaled, advantage + value)
        return _Sample(*(part.reshape(-1, *part.shape[2:]) for part in parts))

    def _step(self, state: PpoState, batch: _Sample) -> tuple[PpoState, jax.Array]:
        config = self.config

        def loss(parameters: tuple[MlpParameters, jax.Array, MlpParameters]) -> tuple[jax.Array, jax.Array]:
            actor, log_std, critic = parameters
            mean = apply_mlp(actor, batch.observation, self.activate)
            ratio = jnp.exp(_log_prob(mean, log_std, batch.action) - batch.log_prob)
            clipped = jnp.clip(ratio, 1 - config.clip, 1 + config.clip)
            surrogate = jnp.minimum(ratio * batch.advantage, clipped * batch.advantage).mean()
            value = apply_mlp(critic, batch.observation, self.activate)[..., 0]
            error = ((value - batch.value_goal) ** 2).mean()
            log_ratio = jnp.log(ratio)
            divergence = (ratio - 1.0 - log_ratio).mean()
            return -surrogate + error - config.entropy * log_std.sum(), divergence

        parameters = (state.actor, state.log_std, state.critic)
        gradient, divergence = jax.grad(loss, has_aux=True)(parameters)
        changes, optimizer = self._tx.update(gradient, state.optimizer)
        learns = state.iterations >= config.critic_iterations
        moved, spread, valued = jax.tree.map(lambda change: -state.rate * change, changes)
        moved, spread = jax.tree.map(lambda change: jnp.where(learns, change, 0.0), (moved, spread))
        changes = (moved, spread, valued)
        actor, log_std, critic = optax.apply_updates(parameters, changes)
        share = state.iterations * config.worlds * config.chunk / config.total_steps
        late = jnp.clip(2.0 * share - 1.0, 0.0, 1.0)
        aim = config.divergence * (1.0 - (1.0 - config.final_divergence) * late)
        rate = jnp.where(divergence > 2.0 * aim, state.rate / _RATE_FACTOR, state.rate)
        rate = jnp.where(divergence < 0.5 * aim, rate * _RATE_FACTOR, rate)
        rate = jnp.where(learns, rate, state.rate)
        average = jax.tree.map(lambda old, new: old + config.average_rate * (new - old), state.average, actor)
        return (
            state._replace(
                actor=actor,
                log_std=jnp.clip(log_std, _MIN_LOG_STD, _MAX_LOG_STD),
                critic=critic,
                optimizer=optimizer,
                rate=jnp.clip(rate, _MIN_RATE, _MAX_RATE),
                average=average,
            ),
            divergence,
        )

    def sample_actions(self, state: PpoState, observation: Any, rng: np.random.Generator) -> Any:
        """Draw actions before tanh, in NumPy, with a state of NumPy's arrays."""
        deviation = np.sqrt(np.maximum(state.variance, self.config.least_deviation**2) + _EPSILON)
        x = (observation - np.asarray(state.mean)) / deviation
        mean = apply_mlp(state.actor, x, self._activate_in_numpy)
        noise = rng.standard_normal(mean.shape, np.float32)
        return (mean + np.exp(np.asarray(state.log_std)) * noise).astype(np.float32)
