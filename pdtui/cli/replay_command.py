"""`pdtui replay`: run a session again and compare it, or watch it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_sessions
from pdtui.cli.options.screen_options import screen_options
from pdtui.cli.options.shared_options import FILE_PATH, policy_option
from pdtui.cli.screen.show_drive import show_drive
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.errors import SessionError
from pdtui.core.printable_text import make_printable
from pdtui.core.settings.user_settings import UserSettings


def replay_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--policy``, ``--tolerance`` and ``--strict``, which the command gets as `options` of a replay."""

    @policy_option("the session's policy")
    @click.option(
        "--tolerance",
        type=click.FloatRange(0),
        metavar="SPREADS",
        help="On another machine or with other versions, accept attributes that differ by at most this "
        "many of their standard deviations in the first 5 control steps.  [default: 5e-06]",
    )
    @click.option("--strict", is_flag=True, help="Accept only identical bits, on any machine.")
    @wraps(command)
    def with_options(*args: Any, tolerance: float | None, strict: bool, policy: str, **others: Any) -> Any:
        options: dict[str, Any] = {"strict": strict, "policy": policy}
        if tolerance is not None:
            options["tolerance"] = tolerance
        return command(*args, options=options, **others)

    return with_options


@click.command()
@click.argument("session", type=FILE_PATH, shell_complete=complete_sessions)
@click.option("--watch", is_flag=True, help="Show the replay on the screen, at the pace of the drive.")
@click.option(
    "--minutes",
    type=click.FloatRange(0, min_open=True),
    metavar="MINUTES",
    help="End the replay after this time, with the steps compared so far.",
)
@screen_options
@replay_options
def replay_command(
    session: Path, watch: bool, minutes: float | None, settings: UserSettings, options: dict[str, Any]
) -> None:
    """Run SESSION again and compare every step.

    Exit codes: 0 if the drive repeats; 1 if it does not, or cannot be replayed.
    """
    from pdtui.driving.session_replay import config_from_session, replay_session

    if watch and minutes is not None:
        raise SessionError("--minutes and --watch are mutually exclusive; q ends a replay that is watched")
    if watch:
        from pdtui.sessions.session_header import read_session_header

        recorded = read_session_header(session)
        if recorded.steps == 0:
            raise SessionError(f"{session}: no control step is recorded, so there is nothing to watch")
        show_drive(config_from_session(recorded, str(session), options["policy"]), settings, watching=True)
        return
    with progress_bar("replaying") as advance:
        result = replay_session(session, minutes=minutes, progress=advance, **options)
    click.echo(make_printable(result.verdict), err=not result.passed)
    if not result.identical:
        for line in (*result.deviations[:5], *result.environment):
            click.echo(f"  {make_printable(str(line))}", err=True)
    if not result.passed:
        sys.exit(1)
