"""`pdtui figure`: figures as PNG files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_robots
from pdtui.cli.options.robot_option_flag import parse_robot_options, robot_option_flag
from pdtui.cli.options.shared_options import (
    FILE_PATH,
    import_option_flags,
    integer_option,
    overwrite_option,
    own_policy_option,
    preset_option,
)
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.printable_text import make_printable


@click.group()
def figure_command() -> None:
    """Draw figures as PNG files."""


@figure_command.command("episode")
@click.argument("robot", shell_complete=complete_robots)
@robot_option_flag
@own_policy_option
@import_option_flags
@click.option(
    "--attribute", "attributes", multiple=True, metavar="NAME", help="Attribute to draw; may be repeated."
)
@click.option(
    "--unit",
    "units",
    multiple=True,
    metavar="LAYER:INDEX",
    help="Unit to draw with it, one per --attribute; default: its best match.",
)
@preset_option
@integer_option("--seed", least=0, most=2**31 - 1, default=1000, help="Seed of the episode.")
@click.option(
    "--from",
    "start",
    type=click.FloatRange(0),
    default=0.0,
    show_default=True,
    metavar="SECONDS",
    help="Time in the episode at which the figure begins.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(0, min_open=True),
    default=10.0,
    show_default=True,
    metavar="SECONDS",
    help="Length of time to draw.",
)
@click.option(
    "-o", "--output", type=FILE_PATH, required=True, metavar="FILE", help="File to write: .png, .pdf or .svg."
)
@overwrite_option
def episode_command(
    robot: str,
    robot_options: tuple[str, ...],
    policy: str,
    start: float,
    seconds: float,
    output: Path,
    overwrite: bool,
    **selection: Any,
) -> None:
    """Draw attributes and their matching units over one episode.

    As in figure 2 of the paper. ROBOT is a robot's name or the ID of a Gymnasium environment.
    """
    from pdtui.pictures.matplotlib_page import check_figure_path
    from pdtui.robots import RobotSpec, require_robot_name, trust_module

    trust_module(robot)
    world = RobotSpec(robot, parse_robot_options(require_robot_name(robot), robot_options))
    check_figure_path(output, overwrite)
    from pdtui.pictures.unit_attribute_pairs import draw_unit_attribute_pairs, pair_units_with_attributes

    with progress_bar("rolling out") as advance:
        curves = pair_units_with_attributes(world, policy or robot, progress=advance, **selection)
    draw_unit_attribute_pairs(output, curves, start=start, seconds=seconds)
    for pair in curves.pairs:
        click.echo(
            f"{make_printable(pair.attribute.name)}: unit {pair.unit}, discrepancy {pair.discrepancy:.3g}"
        )
    click.echo(f"wrote {output}")
