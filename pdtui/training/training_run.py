"""What every training run does: evaluate, keep the best, write checkpoints, go on after a kill."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

import jax
import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.training.jax_mlp import MlpParameters
from pdtui.training.training_checkpoint import load_checkpoint, save_checkpoint
from pdtui.training.world_batch import Actor, ActorScore, WorldBatch, score_actor

SELECTION_SEEDS = 1_000_000
REPORT_SEEDS = 2_000_000


class TrainingConfig(Protocol):
    """What the configurations of all algorithms have."""

    @property
    def total_steps(self) -> int: ...
    @property
    def layers(self) -> tuple[int, ...]: ...
    @property
    def evaluate_every(self) -> int: ...
    @property
    def evaluate_episodes(self) -> int: ...
    @property
    def evaluate_steps(self) -> int: ...


@dataclass(frozen=True)
class TrainingReport:
    """Where training stands; the progress bar draws it."""

    steps: int
    total_steps: int
    score: ActorScore | None
    best: ActorScore | None


def numpy_actor(params: MlpParameters, rng: np.random.Generator | None) -> Actor:
    """A squashed Gaussian actor in NumPy: mean actions, or samples where a generator is given."""
    layers = [(np.asarray(layer["w"]), np.asarray(layer["b"])) for layer in params]

    def act(observation: NDArray[np.float32]) -> NDArray[np.float32]:
        x = observation
        for weight, bias in layers[:-1]:
            x = np.tanh(x @ weight + bias)
        mean, log_std = np.split(x @ layers[-1][0] + layers[-1][1], 2, axis=-1)
        if rng is not None:
            noise = rng.standard_normal(mean.shape, np.float32)
            mean = mean + np.exp(np.clip(log_std, -5.0, 2.0)) * noise
        action: NDArray[np.float32] = np.tanh(mean)
        return action

    return act


def actor_to_network(params: MlpParameters, spec: NetworkSpec) -> PolicyNetwork:
    """The actor as the network that the policy runtime loads."""
    network = PolicyNetwork(spec)
    tensors = dict(network.state_dict())
    for index, layer in enumerate(params):
        name = "head" if index == len(params) - 1 else f"hidden.{index}"
        tensors[f"{name}.weight"] = torch.from_numpy(np.array(layer["w"]).T.copy())
        tensors[f"{name}.bias"] = torch.from_numpy(np.array(layer["b"]).copy())
    network.load_tensors(tensors)
    return network


def _steadiness(score: dict[str, Any]) -> float:
    """What the best policy has most of: return less its deviation, so that rare falls count against speed."""
    return float(score["mean_return"]) - float(score["std_return"])


class TrainingRun(ABC):
    """One training run in a folder; a run that was cut off goes on from its last checkpoint.

    The order of everything is fixed by the seed: a run that was killed and resumed ends with the same
    weights as one that was not.
    """

    algorithm: ClassVar[str]
    state: Any
    worlds: Sequence[WorldBatch]

    def __init__(
        self, robot: str, seed: int, folder: Path, config: TrainingConfig, command: str, **robot_options: Any
    ) -> None:
        self.seed, self.folder, self._config, self.command, self.robot = seed, folder, config, command, robot
        self.make: Callable[[], Robot] = lambda: make_robot(robot, **robot_options)
        self.sample = self.make()
        bounds = self.sample.action_space
        self.observations = int(np.prod(self.sample.observation_space.shape or ()))
        self.actions = int(np.prod(bounds.shape or ()))
        self._low, self._high = (np.asarray(getattr(bounds, side), np.float64) for side in ("low", "high"))
        self.rng = np.random.default_rng(seed)
        self.steps = 0
        self.best: dict[str, Any] | None = None
        folder.mkdir(parents=True, exist_ok=True)
        self.build()
        if self.checkpoint.exists():
            self.state, progress, memory = load_checkpoint(self.checkpoint, self.state, self.worlds, self.rng)
            self.steps, self.best = int(progress["steps"]), progress["best"]
            self.remember(memory, progress)

    @abstractmethod
    def build(self) -> None:
        """Make worlds, learner and the untrained state."""

    @abstractmethod
    def advance(self) -> int:
        """Collect and learn once; returns the control steps that it took."""

    @abstractmethod
    def kept_actor(self) -> MlpParameters:
        """The actor that is evaluated and saved: on raw observations, mean and log deviation."""

    def memory(self) -> dict[str, NDArray[Any]]:
        """Further arrays that a checkpoint must keep."""
        return {}

    def progress(self) -> dict[str, Any]:
        """What else a checkpoint must keep."""
        return {"steps": self.steps, "best": self.best}

    def remember(self, memory: dict[str, NDArray[Any]], progress: dict[str, Any]) -> None:
        """Take back what `memory` and `progress` gave."""
        del memory, progress

    @property
    def checkpoint(self) -> Path:
        return self.folder / "checkpoint.safetensors"

    @property
    def best_weights(self) -> Path:
        return self.folder / "best.safetensors"

    def run(self, report: Callable[[TrainingReport], None]) -> Path:
        """Train to the end and return the path of the best weights, scored on fresh seeds."""
        config, reports = self._config, 0
        while self.steps < config.total_steps:
            taken = self.advance()
            self.steps += taken
            score = None
            if self.steps % config.evaluate_every < taken or self.steps >= config.total_steps:
                score = self._evaluate()
                jax.block_until_ready(self.state)
                save_checkpoint(
                    self.checkpoint, self.state, self.worlds, self.rng, self.progress(), self.memory()
                )
            reports += 1
            if score is not None or reports % 16 == 0:
                report(TrainingReport(self.steps, config.total_steps, score, self._best_score()))
        return self.best_weights

    def to_robot(self, squashed: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions in (−1, 1) rescaled to the robot's bounds."""
        scaled = self._low + (squashed + 1.0) * 0.5 * (self._high - self._low)
        return scaled.astype(np.float32)

    def _evaluate(self) -> ActorScore:
        config, params = self._config, self.kept_actor()
        seeds = range(SELECTION_SEEDS, SELECTION_SEEDS + config.evaluate_episodes)
        actor = numpy_actor(params, None)
        score = score_actor(self.make, lambda seen: self.to_robot(actor(seen)), seeds, config.evaluate_steps)
        with (self.folder / "log.jsonl").open("a") as log:
            log.write(json.dumps({"steps": self.steps, **asdict(score)}) + "\n")
        if self.best is None or _steadiness(asdict(score)) > _steadiness(self.best):
            self.best = {"steps": self.steps, **asdict(score)}
            self._save_best(params, actor)
        return score

    def _save_best(self, params: MlpParameters, actor: Actor) -> None:
        config = self._config
        fresh = range(REPORT_SEEDS, REPORT_SEEDS + config.evaluate_episodes)
        final = score_actor(self.make, lambda seen: self.to_robot(actor(seen)), fresh, config.evaluate_steps)
        spec = NetworkSpec(
            robot=self.robot,
            observations=self.observations,
            layers=config.layers,
            activation="tanh",
            actions=self.actions,
            head="squashed_gaussian",
            action_low=tuple(self._low.tolist()),
            action_high=tuple(self._high.tolist()),
            command=self.command,
            score={"steps": self.steps, **asdict(final)},
        )
        save_network(self.best_weights, actor_to_network(params, spec))

    def _best_score(self) -> ActorScore | None:
        if self.best is None:
            return None
        return ActorScore(**{name: self.best[name] for name in ActorScore.__dataclass_fields__})
