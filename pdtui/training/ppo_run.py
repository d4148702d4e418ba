"""Collecting for PPO: many worlds, stepped by two threads, since MuJoCo lets go of Python while it steps.

Where a simulator does not, each thread waits for a process of worlds.
"""

from __future__ import annotations

import pkgutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, ClassVar

import jax
import numpy as np
from numpy.typing import NDArray

from pdtui.policies.weights.weights_file import find_weights_file, load_network
from pdtui.training.jax_mlp import MlpParameters
from pdtui.training.policy_graft import actor_of, graft_policy
from pdtui.training.ppo import PpoConfig, PpoLearner, PpoRollout, PpoState, act
from pdtui.training.remote_worlds import RemoteWorldBatch
from pdtui.training.training_run import TrainingRun, numpy_actor
from pdtui.training.world_batch import WorldBatch

THREADS = 2
_FIRST_LOOK = 200


class PpoTrainingRun(TrainingRun):
    """A run of PPO; see `TrainingRun`."""

    algorithm: ClassVar[str] = "ppo"

    def __init__(
        self, robot: str, seed: int, folder: Path, config: PpoConfig, command: str, **robot_options: Any
    ) -> None:
        self.config, self._options = config, robot_options
        super().__init__(robot, seed, folder, config, command, **robot_options)

    def build(self) -> None:
        share, recipe = self.config.worlds // THREADS, self.sample.training_recipe
        seeds = [self.seed * 10 + 1 + n for n in range(THREADS)]
        if recipe.world_batch:
            batch = pkgutil.resolve_name(recipe.world_batch)
            self.worlds = [batch(self.sample, self.config.worlds, seeds[0])]
        elif self.config.processes:
            self.worlds = [RemoteWorldBatch(self.robot, self._options, share, seed) for seed in seeds]
        else:
            self.worlds = [WorldBatch(self.make, share, seed) for seed in seeds]
        self.learner = PpoLearner(self.config, self.observations, self.actions)
        self.state = self.learner.init(self.seed)
        self._threads = ThreadPoolExecutor(THREADS)
        if recipe.initial_policy and not self.checkpoint.exists():
            self._begin_from(find_weights_file(recipe.initial_policy))

    def advance(self) -> int:
        on_host: PpoState = jax.tree.map(np.asarray, self.state)
        rows = [self._collect(on_host) for _ in range(self.config.chunk)]
        rollout = PpoRollout(*(np.stack(column) for column in zip(*rows, strict=True)))
        self.state, _ = self.learner.update(self.state, rollout)
        return self.config.worlds * self.config.chunk

    def kept_actor(self) -> MlpParameters:
        return self.learner.folded_actor(self.state)

    def _begin_from(self, weights: Path) -> None:
        actor = actor_of(load_network(weights))
        act, inputs = numpy_actor(actor, None), actor[0]["w"].shape[0]
        seen = []
        for _ in range(_FIRST_LOOK):
            observations = np.concatenate([group.observations for group in self.worlds])
            seen.append(observations)
            actions = self.to_robot(act(observations[:, :inputs]))
            shares = np.split(actions, len(self.worlds))
            list(self._threads.map(_step, self.worlds, shares))
        self.state = graft_policy(self.learner, self.state, actor, np.concatenate(seen))

    def _collect(self, state: PpoState) -> PpoRollout:
        observation = np.concatenate([group.observations for group in self.worlds])
        action = act(state, observation, self.rng)
        shares = np.split(self.to_robot(np.tanh(action)), len(self.worlds))
        rows = list(self._threads.map(_step, self.worlds, shares))

        def joined(column: str) -> NDArray[np.float32]:
            return np.concatenate([getattr(row, column) for row in rows])

        restarted = np.concatenate([group.restarted for group in self.worlds]).astype(np.float32)
        return PpoRollout(
            observation, action, joined("reward"), joined("discount"), joined("following"), restarted
        )


def _step(group: WorldBatch, actions: NDArray[np.float32]) -> Any:
    return group.step(actions)
