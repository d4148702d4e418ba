"""The command line: each command calls one package and prints the result.

Commands, and the heavy libraries that they need, are loaded only when they are used.
"""

from __future__ import annotations

import os

import click

from pdtui import __version__
from pdtui.cli.command_group import LazyCommandGroup
from pdtui.cli.completion import shell_scripts as _shell_scripts  # noqa: F401 - completes Bash by it

COMMANDS = {
    "drive": "Drive a robot with the keys of its map.",
    "robots": "List the robots.",
    "maps": "List the maps.",
    "replay": "Repeat a session and compare every step.",
    "guide": "Read the guide.",
    "serve": "Show the screen in a browser.",
    "config": "Print the settings, and what they do.",
    "completion": "Print a script for completion in the shell.",
    "sessions": "List, inspect, verify, repair and export sessions.",
    "evaluate": "Measure what the behaviors of a map do.",
    "dissect": "Find the units that steer a robot; write a map.",
    "pursue": "Search for units that accomplish a task.",
    "tune": "Tune the PID gains of a map.",
    "figure": "Draw figures.",
    "convert": "Convert a policy to safetensors.",
    "train": "Train a policy.",
    "dynamics": "Follow units through the checkpoints of a training run.",
    "study": "Test a hypothesis on many policies.",
    "bench": "Measure speed and memory.",
}
"""The summary of each command in `pdtui --help`; `pdtui.cli.NAME_command` has the command."""
ABOUT_PROGRAM = ("robots", "maps", "guide", "serve", "config", "completion")
"""Commands that are in the package `pdtui.cli.program` instead."""


@click.group(
    cls=LazyCommandGroup,
    summaries=COMMANDS,
    packages=dict.fromkeys(ABOUT_PROGRAM, "program"),
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__)
@click.pass_context
def main(ctx: click.Context) -> None:
    """Drive a trained neural controller by stimulating its hidden units.

    Without a command, the home screen lists robots, maps, recent sessions and reports.
    """
    # A policy computes with one thread; PyTorch, which is not loaded yet, then need not switch in every step.
    os.environ.setdefault("MKL_NUM_THREADS", "1")
    if ctx.invoked_subcommand is None:
        from pdtui.cli.screen.home import show_home

        show_home()
