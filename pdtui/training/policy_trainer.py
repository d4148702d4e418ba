"""What every training run does: evaluate, keep the best weights, write checkpoints, continue after a kill."""

from __future__ import annotations

import json
import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import jax
import numpy as np
from numpy.typing import NDArray

from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.core.errors import SimulationDiverged
from pdtui.core.outcome import Outcome, is_failure
from pdtui.policies.runtime.jax_multilayer_perceptron import MlpParameters
from pdtui.policies.weights.policy_network import NetworkSpec
from pdtui.policies.weights.weights_file import CHECKPOINT_FOLDER, save_network
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.training.actor_conversion import Actor, actor_to_network, make_numpy_actor
from pdtui.training.robot_batch import RobotBatch
from pdtui.training.training_checkpoint import load_checkpoint, save_checkpoint
from pdtui.training.training_config import TrainingConfig

# First seeds of the episodes that select the best weights, and of those that its published score comes from.
SELECTION_SEEDS, REPORT_SEEDS = 1_000_000, 2_000_000
_ITERATIONS_PER_REPORT = 16
_CHECKPOINTS = 50  # parts of a run after each of which the policy is kept on request
Config = TypeVar("Config", bound=TrainingConfig)


@dataclass(frozen=True)
class ActorScore:
    """What an actor reaches: means over episodes, and how many failed (falls, for a walker) and arrived."""

    episodes: int
    mean_return: float
    std_return: float
    mean_speed: float
    falls: int
    arrivals: int = 0

    @property
    def steadiness(self) -> float:
        """Return less its deviation, so that rare falls weigh against speed."""
        return self.mean_return - self.std_return


def score_actor(robots: Sequence[Robot], actor: Actor, seeds: range, steps: int) -> ActorScore:
    """Run one episode per seed with an actor, one on every robot at a time."""
    groups = [seeds[first : first + len(robots)] for first in range(0, len(seeds), len(robots))]
    runs = [_run_episodes(robots[: len(group)], actor, group, steps) for group in groups]
    returns, speeds = (np.concatenate(column) for column in list(zip(*runs, strict=True))[:2])
    outcomes = [outcome for _, _, group in runs for outcome in group]
    return ActorScore(
        len(seeds),
        float(returns.mean()),
        float(returns.std()),
        float(speeds.mean()),
        sum(map(is_failure, outcomes)),
        outcomes.count(Outcome.ARRIVED),
    )


def _run_episodes(
    robots: Sequence[Robot], actor: Actor, seeds: range, steps: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[Outcome | None]]:
    """Return return, mean speed and outcome of the episode of each seed."""
    observations = np.array([robot.reset(seed=s)[0] for robot, s in zip(robots, seeds, strict=True)])
    speed_column = robots[0].attribute_index("speed")
    returns, speeds, lengths = np.zeros(len(robots)), np.zeros(len(robots)), np.zeros(len(robots))
    outcomes: list[Outcome | None] = [None] * len(robots)
    over = np.zeros(len(robots), bool)
    for _ in range(steps):
        if over.all():
            break
        actions = actor(observations.astype(np.float32))
        for index in np.flatnonzero(~over).tolist():
            robot = robots[index]
            try:
                observation, reward, terminated, truncated, info = robot.step(actions[index])
            except SimulationDiverged:
                outcomes[index], over[index] = Outcome.DIVERGED, True
                continue
            observations[index] = observation
            returns[index] += float(reward)
            speeds[index] += float(robot.read_attributes()[speed_column])
            lengths[index] += 1
            outcomes[index] = robot.outcome_of(terminated, truncated, info)
            over[index] = outcomes[index] is not None
    return returns, speeds / np.maximum(lengths, 1), outcomes


class PolicyTrainer(ABC, Generic[Config]):
    """One training run in a folder, which continues from its last checkpoint if there is one.

    The seed fixes the order of everything: a run that was killed and resumed ends with the same weights as
    one that was not, and one whose robots step on a cluster with the same as one on this machine.
    """

    state: Any
    batches: Sequence[RobotBatch]

    def __init__(
        self,
        robot: str,
        seed: int,
        folder: Path,
        config: Config,
        command: str,
        cluster: RayCluster | None = None,
        **robot_options: Any,
    ) -> None:
        self.cluster = cluster
        self.seed, self.folder, self.config, self.command = seed, folder, config, command
        self.robot, self.robot_options = robot, robot_options
        self.make: Callable[[], Robot] = lambda: make_robot(robot, **robot_options)
        self.sample = self.make()
        bounds = self.sample.action_space
        self.observations = int(np.prod(self.sample.observation_space.shape or ()))
        self.actions = int(np.prod(bounds.shape or ()))
        self._low, self._high = (np.asarray(getattr(bounds, side), np.float64) for side in ("low", "high"))
        self.rng = np.random.default_rng(seed)
        self.steps = 0
        self.best: dict[str, Any] | None = None
        self._evaluated: list[Robot] = []
        self.checkpoint, self.best_weights = (folder / f"{n}.safetensors" for n in ("checkpoint", "best"))
        folder.mkdir(parents=True, exist_ok=True)
        self.build()
        if self.checkpoint.exists():
            kept = load_checkpoint(self.checkpoint, self.state, self.batches, self.rng)
            self.state, progress, arrays = kept
            self.steps, self.best = int(progress["steps"]), progress["best"]
            self.restore_further(arrays, progress)

    @property
    def has_initial_policy(self) -> bool:
        """Whether the run begins from a policy, so that its start is worth an evaluation."""
        return bool(self.config.initial_policy or self.sample.training_recipe.initial_policy)

    @abstractmethod
    def build(self) -> None:
        """Make the robots, the learner and the untrained state."""

    @abstractmethod
    def advance(self) -> int:
        """Collect and learn once; return the number of control steps taken."""

    @abstractmethod
    def averaged_actor(self) -> MlpParameters:
        """Return the actor to evaluate and save: on raw observations, with means and log deviations."""

    def further_arrays(self) -> dict[str, NDArray[Any]]:
        """Return further arrays that a checkpoint must hold."""
        return {}

    def progress(self) -> dict[str, Any]:
        """Return further JSON data that a checkpoint must hold."""
        return {"steps": self.steps, "best": self.best}

    def restore_further(self, arrays: dict[str, NDArray[Any]], progress: dict[str, Any]) -> None:
        """Take back what `further_arrays` and `progress` returned."""
        del arrays, progress

    def run(self, report: Callable[[int, ActorScore | None, ActorScore | None], None]) -> Path:
        """Train to the end and return the path of the best weights, scored on fresh seeds.

        Args:
            report: Called with the control steps so far, the score if there was an evaluation, and the best.
        """
        config, iterations = self.config, 0
        if not self.steps:
            if self.has_initial_policy:
                report(0, self._evaluate(), self._best_score())
            self._keep_checkpoint(0)
        while self.steps < config.total_steps:
            taken, score = self.advance(), None
            self.steps += taken
            self._keep_checkpoint(taken)
            if self.steps % config.evaluate_every < taken or self.steps >= config.total_steps:
                score = self._evaluate()
                jax.block_until_ready(self.state)
                kept = self.state, self.batches, self.rng, self.progress(), self.further_arrays()
                save_checkpoint(self.checkpoint, *kept)
            iterations += 1
            if score is not None or iterations % _ITERATIONS_PER_REPORT == 0:
                report(self.steps, score, self._best_score())
        return self.best_weights

    def to_robot(self, squashed: NDArray[np.float32]) -> NDArray[np.float32]:
        """Rescale actions from (−1, 1) to the robot's bounds."""
        return (self._low + (squashed + 1.0) * 0.5 * (self._high - self._low)).astype(np.float32)

    def make_own_batch(self, seed: int) -> RobotBatch | None:
        """Return the batch of all robots that the recipe has a class for, if it has one."""
        name = self.sample.training_recipe.robot_batch
        return pkgutil.resolve_name(name)(self.sample, self.config.worlds, seed) if name else None

    def _score(self, actor: Actor, first_seed: int) -> ActorScore:
        seeds = range(first_seed, first_seed + self.config.evaluate_episodes)
        if not self._evaluated:
            count = min(self.config.evaluate_robots, self.config.evaluate_episodes)
            self._evaluated = [self.make() for _ in range(count)]
        steps = self.config.evaluate_steps
        return score_actor(self._evaluated, lambda seen: self.to_robot(actor(seen)), seeds, steps)

    def _evaluate(self) -> ActorScore:
        params = self.averaged_actor()
        actor = make_numpy_actor(params, None, self.config.activation)
        score, best = self._score(actor, SELECTION_SEEDS), self._best_score()
        line = {"steps": self.steps, **asdict(score)}
        with (self.folder / "log.jsonl").open("a") as log:
            log.write(json.dumps(line) + "\n")
        if best is None or score.steadiness > best.steadiness:
            self.best = line
            self._save(self.best_weights, params, asdict(self._score(actor, REPORT_SEEDS)))
        return score

    def _keep_checkpoint(self, taken: int) -> None:
        """Keep the policy if the last steps completed another part of the run, and at its start."""
        part = self.config.total_steps / _CHECKPOINTS
        if self.config.keeps_checkpoints and (not taken or self.steps // part > (self.steps - taken) // part):
            path = self.folder / CHECKPOINT_FOLDER / f"{self.steps:010d}.safetensors"
            self._save(path, self.averaged_actor(), {})

    def _save(self, path: Path, params: MlpParameters, score: dict[str, Any]) -> None:
        spec = NetworkSpec(
            robot=self.robot,
            observations=self.observations,
            layers=self.config.layers,
            activation=self.config.activation,
            actions=self.actions,
            head="squashed_gaussian",
            action_low=tuple(self._low.tolist()),
            action_high=tuple(self._high.tolist()),
            command=self.command,
            score={"steps": self.steps, **score},
        )
        save_network(path, actor_to_network(params, spec))

    def _best_score(self) -> ActorScore | None:
        if self.best is None:
            return None
        known = ActorScore.__dataclass_fields__.keys() & self.best.keys()  # older ones lack the arrivals
        return ActorScore(**{name: self.best[name] for name in known})
