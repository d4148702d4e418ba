"""Proximal Policy Optimisation on a jitted JAX learner.

Schulman et al., "Proximal Policy Optimization Algorithms" (2017): clipped surrogate, generalised
advantages, and a learning rate that follows the divergence between updates. The policy is a Gaussian squashed
by tanh, as in SAC, so that both end in the same network; since the squashing is the same before and after an
update, ratios are those of the Gaussians.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from pdtui.training.jax_mlp import MlpParameters, init_mlp, tanh_mlp


@dataclass(frozen=True)
class PpoConfig:
    """Hyper-parameters; `total_steps` counts control steps over all worlds.

    In the second half, the divergence aimed at falls linearly to `final_divergence` of itself. `processes`
    puts the worlds into processes of their own, which simulators need that do not let go of Python.
    """

    total_steps: int = 2_000_000
    worlds: int = 64
    processes: bool = False
    chunk: int = 32
    epochs: int = 4
    minibatch: int = 512
    layers: tuple[int, ...] = (256, 256)
    learning_rate: float = 3e-4
    divergence: float = 0.012
    final_divergence: float = 0.2
    average_rate: float = 0.002
    clip: float = 0.2
    discount: float = 0.99
    gae: float = 0.95
    entropy: float = 0.001
    log_std: float = -0.5
    reward_scale: float = 0.02
    evaluate_every: int = 200_000
    evaluate_episodes: int = 32
    evaluate_steps: int = 1000


class PpoState(NamedTuple):
    """All that learning changes; a tree of arrays."""

    actor: MlpParameters
    log_std: jax.Array
    critic: MlpParameters
    optimiser: Any
    rate: jax.Array
    key: jax.Array
    mean: jax.Array
    variance: jax.Array
    rows_seen: jax.Array
    iterations: jax.Array
    average: MlpParameters
    """Moving average of the actor: it walks more steadily than any single actor, so it is what is kept."""


class PpoRollout(NamedTuple):
    """What was collected, leading axes (steps, worlds); observations are raw, actions before tanh."""

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
    old_mean: jax.Array


def normalise(state: PpoState, observation: jax.Array) -> jax.Array:
    """Observations by the running mean and deviation."""
    return (observation - state.mean) / jnp.sqrt(state.variance + 1e-8)


def _log_prob(mean: jax.Array, log_std: jax.Array, action: jax.Array) -> jax.Array:
    return (-0.5 * ((action - mean) / jnp.exp(log_std)) ** 2 - log_std).sum(-1)


class PpoLearner:
    """Builds the first state and the jitted update."""

    def __init__(self, config: PpoConfig, observations: int, actions: int) -> None:
        self.config, self.observations, self.actions = config, observations, actions
        self._tx = optax.chain(optax.clip_by_global_norm(1.0), optax.scale_by_adam())
        self.update = jax.jit(self._update)

    def init(self, seed: int) -> PpoState:
        """The untrained state."""
        config = self.config
        key, actor_key, critic_key = jax.random.split(jax.random.PRNGKey(seed), 3)
        actor = init_mlp(actor_key, (self.observations, *config.layers, self.actions), False)
        actor[-1] = jax.tree.map(lambda leaf: 0.01 * leaf, actor[-1])
        critic = init_mlp(critic_key, (self.observations, *config.layers, 1), False)
        log_std = jnp.full(self.actions, config.log_std)
        return PpoState(
            actor,
            log_std,
            critic,
            self._tx.init((actor, log_std, critic)),
            jnp.asarray(config.learning_rate),
            key,
            jnp.zeros(self.observations),
            jnp.ones(self.observations),
            jnp.asarray(1e-4),
            jnp.zeros(()),
            jax.tree.map(jnp.copy, actor),
        )

    def folded_actor(self, state: PpoState) -> MlpParameters:
        """The actor on raw observations, with log standard deviations as constant outputs."""
        deviation = jnp.sqrt(state.variance + 1e-8)
        first = state.average[0]
        weight = first["w"] / deviation[:, None]
        head = state.average[-1]
        return [
            {"w": weight, "b": first["b"] - state.mean @ weight},
            *state.average[1:-1],
            {
                "w": jnp.concatenate([head["w"], jnp.zeros_like(head["w"])], axis=1),
                "b": jnp.concatenate([head["b"], state.log_std]),
            },
        ]

    def _update(self, state: PpoState, rollout: PpoRollout) -> tuple[PpoState, jax.Array]:
        """One iteration on a roll-out; also returns the mean divergence."""
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
        """Merge a batch into the running mean and variance (Chan et al. 1979)."""
        mean, variance, count = rows.mean(0), rows.var(0), rows.shape[0]
        total = state.rows_seen + count
        delta = mean - state.mean
        merged = (
            state.variance * state.rows_seen + variance * count + delta**2 * state.rows_seen * count / total
        ) / total
        return state._replace(
            mean=state.mean + delta * count / total,
            variance=merged,
            rows_seen=jnp.minimum(total, 2_000_000.0),
        )

    def _samples(self, state: PpoState, rollout: PpoRollout) -> _Sample:
        config = self.config
        observation = normalise(state, rollout.observation)
        value = tanh_mlp(state.critic, observation)[..., 0]
        future = tanh_mlp(state.critic, normalise(state, rollout.following))[..., 0]
        delta = rollout.reward * config.reward_scale + config.discount * rollout.discount * future - value

        def backwards(later: jax.Array, now: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
            error, restarted = now
            advantage = error + config.discount * config.gae * (1.0 - restarted) * later
            return advantage, advantage

        _, advantage = jax.lax.scan(
            backwards, jnp.zeros(delta.shape[1]), (delta, rollout.restarted), reverse=True
        )
        mean = tanh_mlp(state.actor, observation)

        def flat(leaf: jax.Array) -> jax.Array:
            return leaf.reshape(-1, *leaf.shape[2:])

        scaled = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        return _Sample(
            flat(observation),
            flat(rollout.action),
            flat(_log_prob(mean, state.log_std, rollout.action)),
            flat(scaled),
            flat(advantage + value),
            flat(mean),
        )

    def _step(self, state: PpoState, batch: _Sample) -> tuple[PpoState, jax.Array]:
        config = self.config

        def loss(parameters: tuple[MlpParameters, jax.Array, MlpParameters]) -> tuple[jax.Array, jax.Array]:
            actor, log_std, critic = parameters
            mean = tanh_mlp(actor, batch.observation)
            ratio = jnp.exp(_log_prob(mean, log_std, batch.action) - batch.log_prob)
            clipped = jnp.clip(ratio, 1 - config.clip, 1 + config.clip)
            surrogate = jnp.minimum(ratio * batch.advantage, clipped * batch.advantage).mean()
            value = tanh_mlp(critic, batch.observation)[..., 0]
            error = ((value - batch.value_goal) ** 2).mean()
            log_ratio = jnp.log(ratio)
            divergence = (ratio - 1.0 - log_ratio).mean()
            return -surrogate + error - config.entropy * log_std.sum(), divergence

        parameters = (state.actor, state.log_std, state.critic)
        gradient, divergence = jax.grad(loss, has_aux=True)(parameters)
        changes, optimiser = self._tx.update(gradient, state.optimiser)
        changes = jax.tree.map(lambda change: -state.rate * change, changes)
        actor, log_std, critic = optax.apply_updates(parameters, changes)
        share = state.iterations * config.worlds * config.chunk / config.total_steps
        late = jnp.clip(2.0 * share - 1.0, 0.0, 1.0)
        aim = config.divergence * (1.0 - (1.0 - config.final_divergence) * late)
        rate = jnp.where(divergence > 2.0 * aim, state.rate / 1.05, state.rate)
        rate = jnp.where(divergence < 0.5 * aim, rate * 1.05, rate)
        average = jax.tree.map(lambda old, new: old + config.average_rate * (new - old), state.average, actor)
        return (
            state._replace(
                actor=actor,
                log_std=jnp.clip(log_std, -3.0, 0.5),
                critic=critic,
                optimiser=optimiser,
                rate=jnp.clip(rate, 1e-6, 2e-3),
                average=average,
            ),
            divergence,
        )


def act(state: PpoState, observation: Any, rng: np.random.Generator) -> Any:
    """Sampled actions before tanh, in NumPy."""
    x = (observation - np.asarray(state.mean)) / np.sqrt(np.asarray(state.variance) + 1e-8)
    for layer in state.actor[:-1]:
        x = np.tanh(x @ np.asarray(layer["w"]) + np.asarray(layer["b"]))
    mean = x @ np.asarray(state.actor[-1]["w"]) + np.asarray(state.actor[-1]["b"])
    noise = rng.standard_normal(mean.shape, np.float32)
    return (mean + np.exp(np.asarray(state.log_std)) * noise).astype(np.float32)
