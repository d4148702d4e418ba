"""The commands; each calls a room and prints what it says.

Heavy libraries load only where a command needs them.
"""

from __future__ import annotations

import click

from pdtui import __version__
from pdtui.cli.bench_command import bench
from pdtui.cli.dissect_command import dissect
from pdtui.cli.drive_commands import drive, pick_and_drive, replay
from pdtui.cli.evaluate_command import evaluate
from pdtui.cli.figure_command import figure
from pdtui.cli.policy_commands import convert, train
from pdtui.cli.pursue_command import pursue
from pdtui.cli.sessions_commands import sessions
from pdtui.cli.shared_options import OneLineErrors
from pdtui.cli.tune_command import tune


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
