"""Collecting for Soft Actor-Critic: a few worlds, a replay buffer, updates while the worlds step."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pdtui.training.jax_mlp import MlpParameters
from pdtui.training.replay_buffer import ReplayBuffer
from pdtui.training.sac import SacConfig, SacLearner, TransitionBatch
from pdtui.training.training_run import TrainingRun, numpy_actor
from pdtui.training.world_batch import Actor, WorldBatch


class SacTrainingRun(TrainingRun):
    """A run of SAC; see `TrainingRun`."""

    algorithm: ClassVar[str] = "sac"

    def __init__(
        self, robot: str, seed: int, folder: Path, config: SacConfig, command: str, **robot_options: Any
    ) -> None:
        self.config = config
        super().__init__(robot, seed, folder, config, command, **robot_options)

    def build(self) -> None:
        config = self.config
        self.worlds = [WorldBatch(self.make, config.worlds, self.seed)]
        self.learner = SacLearner(config, self.observations, self.actions)
        self.state = self.learner.init(self.seed)
        self.replay = ReplayBuffer(config.capacity, self.observations, self.actions)

    def advance(self) -> int:
        config = self.config
        chunk = config.worlds * config.chunk
        actor = numpy_actor(self.state.actor, self.rng)
        if self.replay.size >= config.random_steps:
            batches = self.replay.sample(self.rng, chunk // config.steps_per_update, config.batch)
            # The update runs in XLA's threads while the worlds below step with the actor before it.
            self.state = self.learner.update(self.state, batches)
        for _ in range(config.chunk):
            self._collect(actor)
        return chunk

    def kept_actor(self) -> MlpParameters:
        params: MlpParameters = self.state.average
        return params

    def memory(self) -> dict[str, NDArray[Any]]:
        return dict(self.replay.export())

    def progress(self) -> dict[str, Any]:
        return {**super().progress(), "count": self.replay.count}

    def remember(self, memory: dict[str, NDArray[Any]], progress: dict[str, Any]) -> None:
        self.replay.load(memory, int(progress["count"]))

    def _collect(self, actor: Actor) -> None:
        (worlds,) = self.worlds
        if self.replay.size < self.config.random_steps:
            shape = (self.config.worlds, self.actions)
            squashed = self.rng.uniform(-1.0, 1.0, shape).astype(np.float32)
        else:
            squashed = actor(worlds.observations)
        rows = worlds.step(self.to_robot(squashed))
        self.replay.add(
            TransitionBatch(rows.observation, squashed, rows.reward, rows.discount, rows.following)
        )
