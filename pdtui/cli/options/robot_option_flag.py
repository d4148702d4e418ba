"""``--robot-option``, with which every command that builds a robot takes the robot's options."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from pdtui.core.errors import RobotError
from pdtui.core.printable_text import make_printable

if TYPE_CHECKING:
    from pdtui.robots.options.robot_option import OptionValue, RobotOption
    from pdtui.stimulation.stimulation_map import StimulationMap

robot_option_flag = click.option(
    "--robot-option",
    "robot_options",
    multiple=True,
    metavar="NAME=VALUE",
    help="Option with which the robot is built, such as torque=80 for bipedal_walker; 'help' lists them. "
    "May be repeated.",
)
"""The command gets the texts as `robot_options`."""


def parse_robot_options(robot: str, texts: Sequence[str]) -> dict[str, OptionValue]:
    """Return the options that were typed; ``help`` among them prints what there is and ends the command.

    Raises:
        RobotError: The robot has no such option, or it does not take the value.
    """
    if not texts:
        return {}
    from pdtui.robots import list_robot_options
    from pdtui.robots.options.robot_option import find_option

    available, options = list_robot_options(robot), dict[str, "OptionValue"]()
    if "help" in texts:
        _print_options(robot, available)
        click.get_current_context().exit()
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            option = find_option(available, name)
            if not equals:
                raise ValueError(f"expected {name}=VALUE with {option.expected}")
            options[name] = option.parse(value)
        except ValueError as problem:
            raise RobotError(f"robot '{robot}': --robot-option {text}: {problem}") from problem
    return options


def apply_robot_options(stimulation_map: StimulationMap, options: dict[str, OptionValue]) -> StimulationMap:
    """Return a map for the robot with these options; if it has behaviors for others, say so."""
    from pdtui.robots.options.robot_option import format_robot_options
    from pdtui.stimulation.map_robot_options import put_robot_options

    changed = put_robot_options(stimulation_map, options)
    if changed is not stimulation_map and stimulation_map.behaviors:
        before = format_robot_options(stimulation_map.robot_options) or "the robot's defaults"
        now = format_robot_options(changed.robot_options)
        told = f"{stimulation_map.source}: made for {before}; the robot is built with {now}"
        click.echo(make_printable(told), err=True)
    return changed


def _print_options(robot: str, available: Sequence[RobotOption]) -> None:
    if not available:
        click.echo(make_printable(f"{robot} has no options"))
    for option in available:
        click.echo(make_printable(f"{option}: {option.description}" if option.description else str(option)))
