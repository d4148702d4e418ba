"""`pdtui train`: policies trained for a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_robots
from pdtui.cli.options.robot_option_flag import parse_robot_options, robot_option_flag
from pdtui.cli.options.shared_options import FILE_PATH, integer_option
from pdtui.core.console.progress_bar import progress_bar


def _parse_layers(text: str | None) -> tuple[int, ...] | None:
    if text is None:
        return None
    widths = text.split(",")
    if not all(width.isdecimal() and 0 < int(width) <= 4096 for width in widths):
        raise click.BadParameter(f"expected widths from 1 to 4096 such as 256,256, found '{text}'")
    return tuple(map(int, widths))


@click.command()
@click.argument("robot", shell_complete=complete_robots)
@robot_option_flag
@integer_option("--seed", least=0, most=2**31 - 1, default=0, help="Seed of every random choice.")
@integer_option(
    "--steps", help="Number of control steps, over all worlds; default: that of the robot's recipe."
)
@click.option(
    "--algorithm",
    type=click.Choice(["ppo", "sac"]),
    default="ppo",
    show_default=True,
    help="Proximal policy optimization, or soft actor-critic.",
)
@click.option(
    "--learning-rate",
    type=click.FloatRange(0, min_open=True),
    metavar="RATE",
    help="Learning rate at the start; default: that of the robot's recipe.",
)
@click.option(
    "--layers",
    metavar="WIDTHS",
    callback=lambda _, __, text: _parse_layers(text),
    help="Widths of the hidden layers, such as 256,256; default: those of the robot's recipe.",
)
@click.option(
    "--activation",
    type=click.Choice(["tanh", "relu", "elu"]),
    help="Activation function of the hidden layers, for PPO; default: that of the robot's recipe, or tanh.",
)
@click.option(
    "--initial-policy",
    metavar="FILE",
    help="Weights file or shipped policy that the run starts from. PPO imitates one with other layers first, "
    "and SAC imitates any.",
)
@integer_option(
    "--imitation-rounds",
    most=1000,
    help="Rounds of imitation at the start, of 500 control steps of every world; default: 3.",
)
@click.option(
    "--forward",
    type=click.Choice(["either", "x"]),
    help="Direction in which moving forward is rewarded, for the Ant; default: x, as in Gymnasium's Ant.",
)
@click.option(
    "--checkpoints",
    is_flag=True,
    help="Also keep the policy at the start and after each 2 % of the steps, in FOLDER/checkpoints.",
)
@click.option(
    "--folder",
    type=FILE_PATH,
    metavar="FOLDER",
    help="Folder of the checkpoints; default: runs/ROBOT-ALGORITHM-SEED.",
)
def train_command(
    robot: str,
    robot_options: tuple[str, ...],
    algorithm: str,
    seed: int,
    forward: str | None,
    folder: Path | None,
    **options: Any,
) -> None:
    """Train a policy for ROBOT.

    An interrupted run continues from its last checkpoint when the same command is run again.
    """
    from pdtui.robots import robot_file_stem
    from pdtui.training.train_policy import train_policy

    typed = parse_robot_options(robot, robot_options)
    named = (robot, algorithm, forward, *sorted(map(robot_file_stem, robot_options)), str(seed))
    folder = folder or Path("runs") / "-".join(filter(None, named))
    with progress_bar("training") as advance:
        path = train_policy(
            robot,
            algorithm,
            seed,
            forward=forward,
            robot_options=typed,
            folder=folder,
            progress=advance,
            **options,
        )
    click.echo(f"best weights: {path}")
