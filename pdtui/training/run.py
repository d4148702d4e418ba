"""`pdtui train`: collect, learn, evaluate, keep the best, survive a kill."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.policies.files import save_network
from pdtui.policies.network import NetworkSpec, PolicyNetwork
from pdtui.robots import make_robot
from pdtui.robots.base import Robot
from pdtui.training.checkpoint import load_checkpoint, save_checkpoint
from pdtui.training.replay import ReplayBuffer
from pdtui.training.sac import Batch, LearnerState, Params, SacConfig, SacLearner
from pdtui.training.worlds import Score, Worlds, score_actor

Arrays = NDArray[np.float32]
SELECTION_SEEDS = 1_000_000
REPORT_SEEDS = 2_000_000


@dataclass(frozen=True)
class TrainingReport:
    """Where training stands; the progress bar draws it."""

    steps: int
    total_steps: int
    score: Score | None
    best: Score | None


def numpy_actor(params: Params, rng: np.random.Generator | None) -> Callable[[Arrays], Arrays]:
    """The actor in NumPy: mean actions, or samples where a generator is given."""
    layers = [(np.asarray(layer["w"]), np.asarray(layer["b"])) for layer in params]

    def act(observation: Arrays) -> Arrays:
        x = observation
        for weight, bias in layers[:-1]:
            x = np.tanh(x @ weight + bias)
        mean, log_std = np.split(x @ layers[-1][0] + layers[-1][1], 2, axis=-1)
        if rng is not None:
            noise = rng.standard_normal(mean.shape, np.float32)
            mean = mean + np.exp(np.clip(log_std, -5.0, 2.0)) * noise
        action: Arrays = np.tanh(mean)
        return action

    return act


def to_network(params: Params, spec: NetworkSpec) -> PolicyNetwork:
    """The actor as the network that the policy runtime loads."""
    network = PolicyNetwork(spec)
    tensors = dict(network.state_dict())
    for index, layer in enumerate(params):
        name = "head" if index == len(params) - 1 else f"hidden.{index}"
        tensors[f"{name}.weight"] = torch.from_numpy(np.array(layer["w"]).T.copy())
        tensors[f"{name}.bias"] = torch.from_numpy(np.array(layer["b"]).copy())
    network.load_tensors(tensors)
    return network


class Trainer:
    """One training run in a folder; a run that was cut off goes on from its last checkpoint.

    The order of everything is fixed by the seed: a run that was killed and resumed ends with the same
    weights as one that was not.
    """

    def __init__(
        self, robot: str, seed: int, folder: Path, config: SacConfig, command: str, **robot_options: Any
    ) -> None:
        self.seed, self.folder, self.config, self.command = seed, folder, config, command
        self._make: Callable[[], Robot] = lambda: make_robot(robot, **robot_options)
        self.worlds = Worlds(self._make, config.worlds, seed)
        sample = self.worlds.robots[0]
        bounds = sample.action_space
        self._observations = self.worlds.observations.shape[1]
        self._actions = int(np.prod(bounds.shape or ()))
        self._low, self._high = (np.asarray(getattr(bounds, side), np.float64) for side in ("low", "high"))
        self._robot = robot
        self.learner = SacLearner(config, self._observations, self._actions)
        self.state: LearnerState = self.learner.init(seed)
        self.replay = ReplayBuffer(config.capacity, self._observations, self._actions)
        self.rng = np.random.default_rng(seed)
        self.steps = 0
        self.best: dict[str, Any] | None = None
        folder.mkdir(parents=True, exist_ok=True)
        if self.checkpoint.exists():
            self.state, progress = load_checkpoint(
                self.checkpoint, self.state, self.replay, self.worlds, self.rng
            )
            self.steps, self.best = int(progress["steps"]), progress["best"]

    @property
    def checkpoint(self) -> Path:
        return self.folder / "checkpoint.safetensors"

    @property
    def best_weights(self) -> Path:
        return self.folder / "best.safetensors"

    def run(self, report: Callable[[TrainingReport], None]) -> Path:
        """Train to the end and return the path of the best weights, scored on fresh seeds."""
        config = self.config
        chunk = config.worlds * config.chunk
        while self.steps < config.total_steps:
            actor = numpy_actor(self.state.actor, self.rng)
            if self.replay.size >= config.random_steps:
                batches = self.replay.sample(self.rng, chunk // config.steps_per_update, config.batch)
                # The update runs in XLA's threads while the worlds below step with the actor before it.
                self.state = self.learner.update(self.state, batches)
            for _ in range(config.chunk):
                self._collect(actor)
            self.steps += chunk
            due = self.steps % config.evaluate_every < chunk
            if due or self.steps >= config.total_steps:
                score = self._evaluate()
                self._save()
                report(TrainingReport(self.steps, config.total_steps, score, self._best_score()))
            elif (self.steps // chunk) % 16 == 0:
                report(TrainingReport(self.steps, config.total_steps, None, self._best_score()))
        return self.best_weights

    def _collect(self, actor: Callable[[Arrays], Arrays]) -> None:
        if self.replay.size < self.config.random_steps:
            shape = (self.config.worlds, self._actions)
            squashed = self.rng.uniform(-1.0, 1.0, shape).astype(np.float32)
        else:
            squashed = actor(self.worlds.observations)
        low, high = self._low, self._high
        actions = (low + (squashed + 1.0) * 0.5 * (high - low)).astype(np.float32)
        rows = self.worlds.step(actions)
        self.replay.add(Batch(rows.observation, squashed, rows.reward, rows.discount, rows.following))

    def _evaluate(self) -> Score:
        config = self.config
        seeds = range(SELECTION_SEEDS, SELECTION_SEEDS + config.evaluate_episodes)
        actor = numpy_actor(self.state.actor, None)
        score = score_actor(self._make, actor, seeds, config.evaluate_steps)
        with (self.folder / "log.jsonl").open("a") as log:
            log.write(json.dumps({"steps": self.steps, **asdict(score)}) + "\n")
        if self.best is None or score.mean_return > self.best["mean_return"]:
            self.best = {"steps": self.steps, **asdict(score)}
            fresh = range(REPORT_SEEDS, REPORT_SEEDS + config.evaluate_episodes)
            final = score_actor(self._make, actor, fresh, config.evaluate_steps)
            spec = NetworkSpec(
                robot=self._robot,
                observations=self._observations,
                layers=config.layers,
                activation="tanh",
                actions=self._actions,
                head="squashed_gaussian",
                action_low=tuple(self._low.tolist()),
                action_high=tuple(self._high.tolist()),
                command=self.command,
                score={"steps": self.steps, **asdict(final)},
            )
            save_network(self.best_weights, to_network(self.state.actor, spec))
        return score

    def _best_score(self) -> Score | None:
        if self.best is None:
            return None
        return Score(**{name: self.best[name] for name in Score.__dataclass_fields__})

    def _save(self) -> None:
        jax.block_until_ready(self.state)
        progress = {"steps": self.steps, "best": self.best}
        save_checkpoint(self.checkpoint, self.state, self.replay, self.worlds, self.rng, progress)
