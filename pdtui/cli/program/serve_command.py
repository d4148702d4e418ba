"""`pdtui serve`: the screen in a browser."""

from __future__ import annotations

import click

from pdtui.core.errors import ScreenError

SERVED = ("drive", "replay", "guide")
"""Commands that have a screen."""


@click.command(context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False})
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8000,
    show_default=True,
    metavar="N",
    help="Port on 127.0.0.1 to listen at; 0 for any that is free.",
)
@click.argument("command", nargs=-1, type=click.UNPROCESSED)
@click.pass_context
def serve_command(context: click.Context, port: int, command: tuple[str, ...]) -> None:
    """Show COMMAND in a browser on this machine; without a command, the home screen.

    For example, `pdtui serve drive ant --no-record`. The address that is printed has a secret in it, without
    which nothing is found. Each page that opens it has a process, and a drive, of its own.
    """
    if command:
        _check_command(context, command)
    try:
        from pdtui.tui.browser.browser_server import BrowserServer
    except ModuleNotFoundError as error:
        raise ScreenError(f"{error.name} is not installed; pip install 'pdtui[serve]' brings it") from error
    BrowserServer(command, port).serve_until_ended(
        lambda address: click.echo(f"open {address}\nctrl+c ends it")
    )


def _check_command(context: click.Context, command: tuple[str, ...]) -> None:
    """Refuse what could not be shown, before a browser is opened for it."""
    name, *arguments = command
    if name not in SERVED:
        raise ScreenError(f"pdtui {name} has no screen to serve; available: {', '.join(SERVED)}")
    if name == "replay" and "--watch" not in arguments:
        raise ScreenError("pdtui replay has a screen only with --watch")
    if name == "drive" and "--headless" in arguments:
        raise ScreenError("--headless has no screen to serve")
    program = context.find_root().command
    assert isinstance(program, click.Group)
    found = program.get_command(context, name)
    assert found is not None
    found.make_context(name, list(arguments), parent=context.find_root())
