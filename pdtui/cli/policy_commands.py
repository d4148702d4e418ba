"""`pdtui convert` and `pdtui train`: commands that write policies."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.shared_options import import_option_flags, progress_bar_or_none
from pdtui.policies.weights.import_options import ImportOptions, WorldSpaces


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="The file to write.")
@click.option(
    "--robot", help="The robot that the policy drives. It gives the bounds of actions if FILE lacks them."
)
@import_option_flags
def convert(file: Path, output: Path, robot: str | None, import_options: ImportOptions) -> None:
    """Convert a policy FILE of another program into a safetensors file that needs no further options."""
    from pdtui.policies.weights.policy_loading import convert_policy
    from pdtui.robots import open_robot, trust_module

    trust_module(robot or "")
    spaces = None
    if robot is not None:
        with open_robot(robot) as world:
            spaces = WorldSpaces.of_world(world)
    spec = convert_policy(file, output, import_options, spaces)
    layers = " ".join(str(width) for width in spec.layers)
    click.echo(
        f"wrote {output}: {spec.observations} observations, hidden {layers} {spec.activation}, "
        f"{spec.actions} actions, head {spec.head}; {spec.command}"
    )


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
