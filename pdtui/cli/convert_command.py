"""`pdtui convert`: policies of other programs as safetensors."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.options.robot_option_flag import parse_robot_options, robot_option_flag
from pdtui.cli.options.shared_options import FILE_PATH, import_option_flags
from pdtui.policies.weights.import_options import ImportOptions, ObservationActionSpaces


@click.command()
@click.argument("file", type=FILE_PATH)
@click.option(
    "-o", "--output", type=FILE_PATH, required=True, metavar="FILE.safetensors", help="File to write."
)
@click.option(
    "--robot",
    metavar="ROBOT",
    help="Robot that the policy is to drive, with any options; it gives the bounds of actions if FILE lacks "
    "them.",
)
@robot_option_flag
@import_option_flags
def convert_command(
    file: Path, output: Path, robot: str | None, robot_options: tuple[str, ...], import_options: ImportOptions
) -> None:
    """Convert a policy FILE of another program into a safetensors file that needs no further options.

    A FILE of pdtui for another robot becomes one for ROBOT if observations and actions have the same shapes.
    """
    from pdtui.policies.weights.policy_loading import convert_policy
    from pdtui.robots import RobotSpec, open_robot, trust_module

    if robot_options and robot is None:
        raise click.UsageError("--robot-option needs --robot")
    trust_module(robot or "")
    spaces = None
    if robot is not None:
        with open_robot(RobotSpec(robot, parse_robot_options(robot, robot_options))) as world:
            spaces = ObservationActionSpaces.of_world(world)
    spec = convert_policy(file, output, import_options, spaces)
    layers = " ".join(str(width) for width in spec.layers)
    click.echo(
        f"wrote {output}: {spec.observations} observations, hidden {layers} {spec.activation}, "
        f"{spec.actions} actions, head {spec.head}; {spec.command}"
    )
