"""What `pdtui train` runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from pdtui.core.errors import TrainingError
from pdtui.robots import make_robot, robot_names


def train_policy(
    robot: str,
    algorithm: str,
    seed: int,
    steps: int | None,
    learning_rate: float | None,
    forward: str | None,
    folder: Path,
    progress: Callable[..., None] | None,
) -> Path:
    """Train, or go on training, in a folder; returns the best weights.

    Raises:
        TrainingError: the extra ``train`` is not installed, the robot is an
            environment of Gymnasium or has no such reward, or the folder holds something else.
    """
    if robot not in robot_names():
        raise TrainingError(
            f"expected one of pdtui's own robots ({', '.join(robot_names())}) or another package's, "
            f"found '{robot}'"
        )
    recipe = make_robot(robot).training_recipe
    if forward is not None and "forward" not in recipe.options:
        raise TrainingError(f"--forward chooses the Ant's reward; '{robot}' has only one")
    try:
        from pdtui.training.ppo import PpoConfig
        from pdtui.training.ppo_run import PpoTrainingRun
        from pdtui.training.sac import SacConfig
        from pdtui.training.sac_run import SacTrainingRun
        from pdtui.training.training_run import TrainingReport, TrainingRun
    except ImportError as error:
        raise TrainingError(f"training needs the extra: pip install 'pdtui[train]' ({error})") from error
    options = dict(recipe.options) | ({"forward": forward} if forward else {})
    known = PpoConfig if algorithm == "ppo" else SacConfig
    changes = {name: value for name, value in recipe.settings.items() if name in known.__dataclass_fields__}
    if steps is not None:
        changes["total_steps"] = steps
    if learning_rate is not None:
        changes["learning_rate"] = learning_rate
    config = replace(known(), **changes)
    command = (
        f"pdtui train {robot} --algorithm {algorithm} --seed {seed} --steps {config.total_steps} "
        f"--learning-rate {config.learning_rate:g}" + (f" --forward {forward}" if forward else "")
    )

    def report(state: TrainingReport) -> None:
        if progress is not None:
            best = state.best
            note = f"best return {best.mean_return:.0f}, {best.mean_speed:.2f} m/s" if best else ""
            progress(state.steps, state.total_steps, note)

    run: TrainingRun
    if isinstance(config, PpoConfig):
        run = PpoTrainingRun(robot, seed, folder, config, command, **options)
    else:
        run = SacTrainingRun(robot, seed, folder, config, command, **options)
    return run.run(report)
