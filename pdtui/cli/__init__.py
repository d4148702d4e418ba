"""The command line: each command calls one package and prints the result.

Commands, and the heavy libraries that they need, are loaded only when they are used.
"""

from __future__ import annotations

import click

from pdtui import __version__
from pdtui.cli.command_group import LazyCommandGroup

COMMANDS = {
    "drive": ("pdtui.cli.drive_command:drive_command", "Drive a robot with the keys of its map."),
    "replay": ("pdtui.cli.replay_command:replay_command", "Repeat a session and compare every step."),
    "guide": ("pdtui.cli.guide_command:guide_command", "Read the guide."),
    "sessions": (
        "pdtui.cli.sessions_command:sessions_command",
        "List, inspect, verify, repair and export sessions.",
    ),
    "evaluate": ("pdtui.cli.evaluate_command:evaluate_command", "Measure what the behaviors of a map do."),
    "dissect": (
        "pdtui.cli.dissect_command:dissect_command",
        "Find the units that steer a robot; write a map.",
    ),
    "pursue": ("pdtui.cli.pursue_command:pursue_command", "Search for units that accomplish a task."),
    "tune": ("pdtui.cli.tune_command:tune_command", "Tune the PID gains of a map."),
    "figure": ("pdtui.cli.figure_command:figure_command", "Draw figures as PNG files."),
    "convert": ("pdtui.cli.convert_command:convert_command", "Convert a policy to safetensors."),
    "train": ("pdtui.cli.train_command:train_command", "Train a policy."),
    "bench": ("pdtui.cli.bench_command:bench_command", "Measure speed and memory."),
}
"""Where each command is, and its summary in `pdtui --help`."""


@click.group(cls=LazyCommandGroup, lazy_commands=COMMANDS, invoke_without_command=True)
@click.version_option(__version__)
@click.pass_context
def main(ctx: click.Context) -> None:
    """Drive a trained neural controller by stimulating its hidden units.

    Without a command, choose a robot and a map and drive.
    """
    if ctx.invoked_subcommand is None:
        from pdtui.cli.drive_command import pick_and_drive

        pick_and_drive()
