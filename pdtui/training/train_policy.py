"""What `pdtui train` runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pdtui.core.errors import TrainingError
from pdtui.robots import list_robot_names, make_robot
from pdtui.robots.options.robot_option import NO_ROBOT_OPTIONS, RobotOptions, format_option_value
from pdtui.training.training_config import PpoConfig, SacConfig


def train_policy(
    robot: str,
    algorithm: str,
    seed: int,
    steps: int | None,
    learning_rate: float | None,
    forward: str | None,
    folder: Path,
    progress: Callable[..., None] | None,
    *,
    layers: tuple[int, ...] | None = None,
    activation: str | None = None,
    initial_policy: str | None = None,
    imitation_rounds: int | None = None,
    checkpoints: bool = False,
    robot_options: RobotOptions = NO_ROBOT_OPTIONS,
) -> Path:
    """Train a policy in a folder, or continue there, and return the path of the best weights.

    The robot is built with the options of its recipe, except for those that are given.

    Raises:
        TrainingError: The extra ``train`` is not installed, the robot is an environment of Gymnasium or has
            no choice of a forward reward, the algorithm has no such choice, or the folder holds another run.
    """
    if robot not in list_robot_names():
        raise TrainingError(
            f"expected one of pdtui's own robots ({', '.join(list_robot_names())}) or another package's, "
            f"found '{robot}'"
        )
    recipe = make_robot(robot).training_recipe
    if forward is not None and "forward" not in recipe.options:
        raise TrainingError(f"--forward chooses the Ant's reward; '{robot}' has only one")
    try:
        from pdtui.training.policy_trainer import ActorScore, PolicyTrainer
        from pdtui.training.ppo_trainer import PpoTrainer
        from pdtui.training.sac_trainer import SacTrainer
    except ImportError as error:
        raise TrainingError(f"training needs the extra: pip install 'pdtui[train]' ({error})") from error
    options = {**recipe.options, **({"forward": forward} if forward else {}), **robot_options}
    defaults = PpoConfig() if algorithm == "ppo" else SacConfig()
    choices: dict[str, Any] = {
        "layers": layers,
        "activation": activation,
        "initial_policy": initial_policy,
        "imitation_rounds": imitation_rounds,
        "keeps_checkpoints": checkpoints or None,
    }
    if algorithm == "sac" and activation not in (None, "tanh"):
        raise TrainingError("--activation is for PPO; SAC trains a tanh network")
    if imitation_rounds is not None and not (initial_policy or recipe.settings.get("imitates")):
        raise TrainingError("--imitation-rounds is for runs that begin with a policy; give --initial-policy")
    given = {"total_steps": steps, "learning_rate": learning_rate, **choices}
    settings = {**recipe.settings, **(recipe.sac_settings if algorithm == "sac" else {})}
    changes = {name: value for name, value in settings.items() if hasattr(defaults, name)}
    changes |= {name: value for name, value in given.items() if value is not None}
    config = replace(defaults, **changes)
    command = (
        f"pdtui train {robot} --algorithm {algorithm} --seed {seed} --steps {config.total_steps} "
        f"--learning-rate {config.learning_rate:g}" + (f" --forward {forward}" if forward else "")
    )
    for name, value in robot_options.items():
        command += f" --robot-option {name}={format_option_value(value)}"
    command += f" --layers {','.join(map(str, layers))}" if layers else ""
    command += f" --activation {activation}" if activation else ""
    command += f" --initial-policy {Path(initial_policy).stem}" if initial_policy else ""
    command += f" --imitation-rounds {imitation_rounds}" if imitation_rounds is not None else ""
    command += " --checkpoints" if checkpoints else ""

    def report(taken: int, _: ActorScore | None, best: ActorScore | None) -> None:
        if progress is not None:
            note = f"best return {best.mean_return:.0f}, {best.mean_speed:.2f} m/s" if best else ""
            progress(taken, config.total_steps, note)

    trainer: PolicyTrainer[PpoConfig] | PolicyTrainer[SacConfig]
    if isinstance(config, PpoConfig):
        trainer = PpoTrainer(robot, seed, folder, config, command, **options)
    else:
        trainer = SacTrainer(robot, seed, folder, config, command, **options)
    return trainer.run(report)
