"""Training by Proximal Policy Optimization: many robots, stepped by two threads, and a warm start.

MuJoCo releases Python's lock while it steps. For a simulator that does not, each thread waits for a process.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from pdtui.core.errors import TrainingError
from pdtui.policies.runtime.jax_multilayer_perceptron import MlpParameters, network_to_mlp_parameters
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.policy_network import PolicyNetwork
from pdtui.policies.weights.weights_file import load_network
from pdtui.training.actor_conversion import Actor, make_numpy_actor
from pdtui.training.policy_imitation import fit_actor, imitate, make_demonstrator
from pdtui.training.policy_trainer import PolicyTrainer
from pdtui.training.ppo_learner import PpoLearner, PpoRollout, PpoState
from pdtui.training.remote.remote_robot_batch import RemoteRobotBatch
from pdtui.training.remote.spread_robot_batch import SpreadRobotBatch
from pdtui.training.robot_batch import RobotBatch, TransitionBatch
from pdtui.training.training_config import PpoConfig

THREADS = 2
# Control steps of the initial policy from which the observations are normalized.
_WARM_START_STEPS = 200
# A smaller deviation than this would blow up inputs that hardly change.
_MIN_DEVIATION = 0.01


class PpoTrainer(PolicyTrainer[PpoConfig]):
    """Trains a policy by PPO; see `PolicyTrainer`."""

    def build(self) -> None:
        share, recipe = self.config.worlds // THREADS, self.sample.training_recipe
        seeds = [self.seed * 10 + 1 + n for n in range(THREADS)]
        if (own := self.make_own_batch(seeds[0])) is not None:
            self.batches = [own]
        elif self.cluster is not None:
            worlds, parts = (self.robot, self.robot_options, share), self.cluster.cores // THREADS
            self.batches = [SpreadRobotBatch(*worlds, seed, self.cluster, parts) for seed in seeds]
        elif self.config.processes:
            self.batches = [RemoteRobotBatch(self.robot, self.robot_options, share, seed) for seed in seeds]
        else:
            self.batches = [RobotBatch(self.make, share, seed) for seed in seeds]
        initial = self.config.initial_policy or recipe.initial_policy
        if not (initial or self.config.imitates):  # there is nothing that an untrained critic could spoil
            self.config = replace(self.config, critic_iterations=0)
        self.learner = PpoLearner(self.config, self.observations, self.actions)
        self.state = self.learner.init(self.seed)
        self._threads = ThreadPoolExecutor(THREADS)
        if not self.checkpoint.exists():
            self._begin(initial)

    def advance(self) -> int:
        on_host: PpoState = jax.tree.map(np.asarray, self.state)
        # Threads that wait for each other in a busy loop take many times as long where others use the cores.
        with threadpool_limits(1, "blas"):
            rows = [self._collect(on_host) for _ in range(self.config.chunk)]
        rollout = PpoRollout(*(np.stack(column) for column in zip(*rows, strict=True)))
        self.state, _ = self.learner.update(self.state, rollout)
        return self.config.worlds * self.config.chunk

    def averaged_actor(self) -> MlpParameters:
        return self.learner.folded_actor(self.state)

    def _begin(self, initial: str) -> None:
        """Start from another policy, or from what a rule-based driver does, or untrained."""
        if not initial:
            if self.config.imitates:
                self._imitate(lambda _: np.concatenate([one.suggest_actions() for one in self.batches]))
            return
        network = load_network(find_weights_file(initial))
        same = network.spec.layers == self.config.layers
        if same and network.spec.activation == self.config.activation:
            self._warm_start(network)
        else:
            self._imitate(make_demonstrator(network))

    def _warm_start(self, network: PolicyNetwork) -> None:
        act, seen = make_demonstrator(network), []
        for _ in range(_WARM_START_STEPS):
            seen.append(self._observations())
            self._step(act(seen[-1]))
        actor = network_to_mlp_parameters(network)
        self.state = warm_start_policy(self.learner, self.state, actor, np.concatenate(seen))

    def _imitate(self, demonstrate: Actor) -> None:
        untrained = self.state

        def fit(seen: NDArray[np.float32], actions: NDArray[np.float32]) -> Actor:
            self.state, _ = fit_actor(self.learner, untrained, seen, actions, self.rng)
            return make_numpy_actor(self.averaged_actor(), None, self.config.activation)

        imitate(self._observations, self._step, demonstrate, fit, self.config.imitation_rounds, self.rng)

    def _collect(self, state: PpoState) -> PpoRollout:
        observation = self._observations()
        action = self.learner.sample_actions(state, observation, self.rng)
        rows = TransitionBatch(*map(np.concatenate, zip(*self._step(np.tanh(action)), strict=True)))
        restarted = np.concatenate([batch.restarted for batch in self.batches]).astype(np.float32)
        return PpoRollout(observation, action, rows.reward, rows.discount, rows.following, restarted)

    def _observations(self) -> NDArray[np.float32]:
        return np.concatenate([batch.observations for batch in self.batches])

    def _step(self, squashed: NDArray[np.float32]) -> list[TransitionBatch]:
        shares = np.split(self.to_robot(squashed), len(self.batches))
        return list(self._threads.map(lambda batch, actions: batch.step(actions), self.batches, shares))


def warm_start_policy(
    learner: PpoLearner, state: PpoState, actor: MlpParameters, seen: NDArray[np.float32]
) -> PpoState:
    """Return an untrained state that acts as a trained policy does; its critic stays untrained.

    Args:
        learner: Learner of the run.
        state: Untrained state.
        actor: Trained actor on raw observations, which returns means and log deviations. It observes the
            first columns of what the run observes.
        seen: Raw observations while the policy acts, shape (T, observations), to normalize by.

    Raises:
        TrainingError: The policy has other layers or actions, or observes more.
    """
    mine, theirs = ([layer["w"].shape for layer in layers] for layers in (state.actor, actor))
    observed, actions = theirs[0][0], mine[-1][1]
    if mine[1:-1] != theirs[1:-1] or mine[0][1] != theirs[0][1] or theirs[-1][1] != 2 * actions:
        raise TrainingError(f"expected a policy of layers {mine}, found {theirs}")
    if observed > learner.observations:
        raise TrainingError(f"expected a policy of at most {learner.observations} inputs, found {observed}")
    mean, deviation = seen.mean(axis=0), np.maximum(seen.std(axis=0), _MIN_DEVIATION)
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
