"""`pdtui train`: policies trained for a robot."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.shared_options import progress_bar_or_none


@click.command()
@click.argument("robot")
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=0,
    show_default=True,
    help="Seed of every random choice.",
)
@click.option(
    "--steps", type=click.IntRange(1), help="Control steps, over all worlds; default: the robot's recipe."
)
@click.option("--algorithm", type=click.Choice(["ppo", "sac"]), default="ppo", show_default=True)
@click.option("--learning-rate", type=click.FloatRange(0, min_open=True), help="Learning rate at the start.")
@click.option(
    "--forward",
    type=click.Choice(["either", "x"]),
    help="Direction in which moving forward is rewarded, for the Ant; default: x, as in Gymnasium's Ant.",
)
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Folder of the checkpoints; default: runs/ROBOT-ALGORITHM-SEED.",
)
def train(
    robot: str,
    algorithm: str,
    seed: int,
    steps: int | None,
    learning_rate: float | None,
    forward: str | None,
    folder: Path | None,
) -> None:
    """Train a policy for ROBOT.

    An interrupted training continues from its last checkpoint when the same command is run again.
    """
    from pdtui.training.train_policy import train_policy

    with progress_bar_or_none("training") as advance:
        path = train_policy(
            robot,
            algorithm,
            seed,
            steps,
            learning_rate,
            forward,
            folder or Path("runs") / "-".join(filter(None, (robot, algorithm, forward, str(seed)))),
            advance,
        )
    click.echo(f"best weights: {path}")
