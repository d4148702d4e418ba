"""Training by Soft Actor-Critic: a few robots, a replay buffer, and updates while the robots step."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from pdtui.policies.runtime.jax_multilayer_perceptron import MlpParameters
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.weights_file import load_network
from pdtui.training.actor_conversion import Actor, make_numpy_actor
from pdtui.training.policy_imitation import fit_gaussian_actor, imitate, make_demonstrator
from pdtui.training.policy_trainer import PolicyTrainer
from pdtui.training.remote.spread_robot_batch import SpreadRobotBatch
from pdtui.training.robot_batch import RobotBatch, TransitionBatch
from pdtui.training.sac_learner import SacLearner
from pdtui.training.training_config import SacConfig

# Deviation of the noise on what a rule-based driver does, so that the critics see other actions too.
_DEMONSTRATION_NOISE = 0.2
# With what a run from another policy begins: log deviations about those that the entropy is kept at, and a
# small weight of the entropy, so that an untrained weight does not drive the actor away at once.
_INITIAL_LOG_STD, _INITIAL_LOG_ALPHA = -2.4, -6.0


class ReplayBuffer:
    """The last `capacity` transitions, sampled uniformly with replacement."""

    def __init__(self, capacity: int, observations: int, actions: int) -> None:
        self.capacity, self.count = capacity, 0
        widths = ((observations,), (actions,), (), (), (observations,))
        self.arrays = TransitionBatch(*(np.zeros((capacity, *width), np.float32) for width in widths))

    @property
    def size(self) -> int:
        """Number of transitions that can be sampled."""
        return min(self.count, self.capacity)

    def add(self, rows: TransitionBatch) -> None:
        """Append transitions, leading axis (n,)."""
        places = (self.count + np.arange(len(rows.reward))) % self.capacity
        for array, new in zip(self.arrays, rows, strict=True):
            array[places] = new
        self.count += len(places)

    def sample(self, rng: np.random.Generator, updates: int, batch: int) -> TransitionBatch:
        """Draw batches for a number of updates, leading axes (updates / 2, 2, batch)."""
        index: NDArray[np.int64] = rng.integers(0, self.size, (updates // 2, 2, batch))
        return TransitionBatch(*(array[index] for array in self.arrays))

    def export(self) -> dict[str, NDArray[np.float32]]:
        """Return the filled part by field name."""
        return {f"replay.{name}": array[: self.size] for name, array in self.arrays._asdict().items()}

    def load(self, arrays: dict[str, NDArray[np.float32]], count: int) -> None:
        """Take back what `export` returned when `count` transitions had been added."""
        self.count = count
        for name, array in self.arrays._asdict().items():
            array[: self.size] = arrays[f"replay.{name}"]


class SacTrainer(PolicyTrainer[SacConfig]):
    """Trains a policy by SAC; see `PolicyTrainer`."""

    def build(self) -> None:
        config = self.config
        own = self.make_own_batch(self.seed)
        if own is not None:
            self.batches = [own]
        elif self.cluster is not None:
            worlds, cores = (self.robot, self.robot_options, config.worlds), self.cluster.cores
            self.batches = [SpreadRobotBatch(*worlds, self.seed, self.cluster, cores)]
        else:
            self.batches = [RobotBatch(self.make, config.worlds, self.seed)]
        self.learner = SacLearner(config, self.observations, self.actions)
        self.state = self.learner.init(self.seed)
        self.replay = ReplayBuffer(config.capacity, self.observations, self.actions)
        if config.initial_policy and not self.checkpoint.exists():
            self._imitate(make_demonstrator(load_network(find_weights_file(config.initial_policy))))

    def advance(self) -> int:
        config = self.config
        chunk = config.worlds * config.chunk
        actor = make_numpy_actor(self.state.actor, self.rng)
        if self.replay.size >= config.random_steps:
            batches = self.replay.sample(self.rng, chunk // config.steps_per_update, config.batch)
            # The update runs in XLA's threads while the robots below step with the actor before it.
            self.state = self.learner.update(self.state, batches)
        elif config.initial_policy and self.replay.size >= config.batch:
            batches = self.replay.sample(self.rng, chunk // config.steps_per_update, config.batch)
            self.state = self.learner.update_critics(self.state, batches)
        for _ in range(config.chunk):
            self._collect(actor)
        return chunk

    def averaged_actor(self) -> MlpParameters:
        params: MlpParameters = self.state.average
        return params

    def further_arrays(self) -> dict[str, NDArray[Any]]:
        return dict(self.replay.export())

    def progress(self) -> dict[str, Any]:
        return {**super().progress(), "count": self.replay.count}

    def restore_further(self, arrays: dict[str, NDArray[Any]], progress: dict[str, Any]) -> None:
        self.replay.load(arrays, int(progress["count"]))

    def _imitate(self, demonstrate: Actor) -> None:
        untrained, (batch,) = self.state, self.batches

        def fit(seen: NDArray[np.float32], actions: NDArray[np.float32]) -> Actor:
            actor, _ = fit_gaussian_actor(untrained.actor, seen, actions, _INITIAL_LOG_STD, self.rng)
            self.state = untrained._replace(
                actor=actor, average=jax.tree.map(jnp.copy, actor), log_alpha=jnp.asarray(_INITIAL_LOG_ALPHA)
            )
            return make_numpy_actor(actor, None)

        def step(squashed: NDArray[np.float32]) -> None:
            batch.step(self.to_robot(squashed))

        rounds = self.config.imitation_rounds
        imitate(lambda: np.array(batch.observations), step, demonstrate, fit, rounds, self.rng)

    def _collect(self, actor: Actor) -> None:
        (batch,) = self.batches
        if self.replay.size < self.config.random_steps:
            shape = (self.config.worlds, self.actions)
            if self.config.initial_policy or self.config.imitates:
                noise = _DEMONSTRATION_NOISE * self.rng.standard_normal(shape, np.float32)
                own = self.config.initial_policy
                shown = actor(batch.observations) if own else batch.suggest_actions()
                squashed = np.clip(shown + noise, -1.0, 1.0)
            else:
                squashed = self.rng.uniform(-1.0, 1.0, shape).astype(np.float32)
        else:
            squashed = actor(batch.observations)
        self.replay.add(batch.step(self.to_robot(squashed))._replace(action=squashed))
