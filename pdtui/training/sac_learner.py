"""The learner of Soft Actor-Critic, compiled by JAX.

It follows Haarnoja et al., "Soft Actor-Critic Algorithms and Applications" (2018). Three additions make the
paper's robots walk on two cores: LayerNorm in the critics, an update of the actor at every second update of
the critics, and several updates in one call.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optax

from pdtui.policies.runtime.jax_multilayer_perceptron import MlpParameters, apply_mlp, init_mlp_parameters
from pdtui.training.robot_batch import TransitionBatch
from pdtui.training.training_config import SacConfig


class SacState(NamedTuple):
    """Everything that learning changes, as a tree of arrays; `average` is the moving average of the actor."""

    actor: MlpParameters
    critics: MlpParameters
    targets: MlpParameters
    log_alpha: jax.Array
    actor_opt: Any
    critic_opt: Any
    alpha_opt: Any
    key: jax.Array
    average: MlpParameters


def run_actor(params: MlpParameters, observation: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Return mean and log standard deviation before squashing, each (..., actions)."""
    mean, log_std = jnp.split(apply_mlp(params, observation, jnp.tanh), 2, axis=-1)
    return mean, jnp.clip(log_std, -5.0, 2.0)


def _critic_forward(params: MlpParameters, observation: jax.Array, action: jax.Array) -> jax.Array:
    x = jnp.concatenate([observation, action], axis=-1)
    for layer in params[:-1]:
        x = x @ layer["w"] + layer["b"]
        centered = x - x.mean(-1, keepdims=True)
        x = centered * jax.lax.rsqrt((centered**2).mean(-1, keepdims=True) + 1e-6)
        x = jax.nn.relu(x * layer["scale"] + layer["shift"])
    value: jax.Array = (x @ params[-1]["w"] + params[-1]["b"])[..., 0]
    return value


_both_critics = jax.vmap(_critic_forward, in_axes=(0, None, None))


def _sample(params: MlpParameters, observation: jax.Array, key: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Draw a squashed action and return it with its log probability."""
    mean, log_std = run_actor(params, observation)
    noise = jax.random.normal(key, mean.shape)
    raw = mean + jnp.exp(log_std) * noise
    log_prob = -0.5 * noise**2 - log_std - 0.5 * jnp.log(2 * jnp.pi)
    log_prob -= 2.0 * (jnp.log(2.0) - raw - jax.nn.softplus(-2.0 * raw))
    return jnp.tanh(raw), log_prob.sum(-1)


class SacLearner:
    """Makes the untrained state and the compiled `update`."""

    def __init__(self, config: SacConfig, observations: int, actions: int) -> None:
        self.config, self.observations, self.actions = config, observations, actions
        updates, rate = config.total_steps // config.steps_per_update, config.learning_rate
        self._critic_tx, self._actor_tx, self._alpha_tx = (
            optax.adam(optax.schedules.linear_schedule(rate, rate * config.final_rate, count))
            for count in (updates, max(updates // 2, 1), max(updates // 2, 1))
        )
        self.update, self.update_critics = jax.jit(self._update), jax.jit(self._update_critics)

    def init(self, seed: int) -> SacState:
        """Return the untrained state."""
        config = self.config
        key, actor_key, *critic_keys = jax.random.split(jax.random.PRNGKey(seed), 4)
        actor = init_mlp_parameters(actor_key, (self.observations, *config.layers, 2 * self.actions), False)
        widths = (self.observations + self.actions, *config.layers, 1)
        critics = jax.vmap(partial(init_mlp_parameters, widths=widths, layer_norm=True))(
            jnp.stack(critic_keys)
        )
        (targets, average), log_alpha = jax.tree.map(jnp.copy, (critics, actor)), jnp.zeros(())
        optimizers = self._actor_tx.init(actor), self._critic_tx.init(critics), self._alpha_tx.init(log_alpha)
        return SacState(actor, critics, targets, log_alpha, *optimizers, key, average)

    def _critic_step(self, state: SacState, batch: TransitionBatch) -> SacState:
        key, action_key = jax.random.split(state.key)
        following, log_prob = _sample(state.actor, batch.following, action_key)
        future = _both_critics(state.targets, batch.following, following).min(0)
        future = future - jnp.exp(state.log_alpha) * log_prob
        goal = self.config.reward_scale * batch.reward + batch.discount * self.config.discount * future

        def loss(critics: MlpParameters) -> jax.Array:
            value = _both_critics(critics, batch.observation, batch.action)
            total: jax.Array = ((value - goal) ** 2).mean(-1).sum()
            return total

        changes, critic_opt = self._critic_tx.update(jax.grad(loss)(state.critics), state.critic_opt)
        critics = optax.apply_updates(state.critics, changes)
        tau = self.config.tau
        targets = jax.tree.map(lambda old, new: old + tau * (new - old), state.targets, critics)
        return state._replace(critics=critics, targets=targets, critic_opt=critic_opt, key=key)

    def _actor_step(self, state: SacState, batch: TransitionBatch) -> SacState:
        key, action_key = jax.random.split(state.key)
        alpha = jnp.exp(state.log_alpha)

        def loss(actor: MlpParameters) -> tuple[jax.Array, jax.Array]:
            action, log_prob = _sample(actor, batch.observation, action_key)
            value = _both_critics(state.critics, batch.observation, action).min(0)
            return (alpha * log_prob - value).mean(), log_prob.mean()

        gradient, log_prob = jax.grad(loss, has_aux=True)(state.actor)
        changes, actor_opt = self._actor_tx.update(gradient, state.actor_opt)
        excess = -(log_prob - self.actions)
        alpha_changes, alpha_opt = self._alpha_tx.update(excess, state.alpha_opt)
        actor = optax.apply_updates(state.actor, changes)
        rate = self.config.average_rate
        return state._replace(
            actor=actor,
            average=jax.tree.map(lambda old, new: old + rate * (new - old), state.average, actor),
            actor_opt=actor_opt,
            log_alpha=optax.apply_updates(state.log_alpha, alpha_changes),
            alpha_opt=alpha_opt,
            key=key,
        )

    def _update(self, state: SacState, batches: TransitionBatch) -> SacState:
        """Update the critics for each batch and the actor for each pair; leading axes (pairs, 2, batch)."""

        def pair(state: SacState, batch: TransitionBatch) -> tuple[SacState, None]:
            state = self._critic_step(state, TransitionBatch(*(leaf[0] for leaf in batch)))
            second = TransitionBatch(*(leaf[1] for leaf in batch))
            return self._actor_step(self._critic_step(state, second), second), None

        return jax.lax.scan(pair, state, batches)[0]

    def _update_critics(self, state: SacState, batches: TransitionBatch) -> SacState:
        """Update the critics alone for each batch, leading axes (pairs, 2, batch)."""
        flat = TransitionBatch(*(leaf.reshape(-1, *leaf.shape[2:]) for leaf in batches))
        return jax.lax.scan(lambda kept, batch: (self._critic_step(kept, batch), None), state, flat)[0]
