"""The commands; each calls a room and prints what it says.

Heavy libraries load only where a command needs them.
"""

from __future__ import annotations

import click

from pdtui import __version__
from pdtui.cli.benching import bench
from pdtui.cli.common import OneLineErrors
from pdtui.cli.drawing import figure
from pdtui.cli.driving import drive, pick_and_drive, replay
from pdtui.cli.evaluating import evaluate
from pdtui.cli.making import convert, dissect, pursue, train
from pdtui.cli.sessions import sessions
from pdtui.cli.tuning import tune


@click.group(cls=OneLineErrors, invoke_without_command=True)
@click.version_option(__version__)
@click.pass_context
def main(ctx: click.Context) -> None:
    """Drive a trained neural controller by stimulating its hidden units.

    Without a command, pick a robot and a map and drive.
    """
    if ctx.invoked_subcommand is None:
        pick_and_drive()


for command in (drive, replay, sessions, evaluate, dissect, pursue, tune, figure, convert, train, bench):
    main.add_command(command)
