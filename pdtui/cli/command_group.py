"""A group of commands that loads each command only when it is used."""

from __future__ import annotations

import errno
import resource
from collections.abc import Mapping
from pkgutil import resolve_name
from typing import Any

import click
from click.shell_completion import CompletionItem

from pdtui.core.errors import PdtuiError
from pdtui.core.printable_text import make_printable

OPTIONAL_ROOMS = ("pdtui.benchmarks", "pdtui.paper", "pdtui.study", "pdtui.training")
"""Packages that an installation may leave out; only the commands that need one stop working."""


LEAST_FILES = 64
"""Files that a command may have to hold open; libraries fail in their own ways where fewer are allowed."""
_NAMES_NO_FILE = (errno.ENAMETOOLONG, errno.ELOOP)


class LazyCommandGroup(click.Group):
    """Imports a command's module when the command is used, and prints expected errors as one line.

    `summaries` gives the summary of each command NAME, which is `NAME_command` in `pdtui.cli.NAME_command`.
    `packages` gives the package of `pdtui.cli` that has the module instead.
    """

    def __init__(
        self, *, summaries: Mapping[str, str], packages: Mapping[str, str], **arguments: Any
    ) -> None:
        super().__init__(**arguments)
        self._summaries, self._packages = summaries, packages

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(self._summaries)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        if cmd_name not in self._summaries:
            return None
        package = f"pdtui.cli.{self._packages[cmd_name]}" if cmd_name in self._packages else "pdtui.cli"
        command = resolve_name(f"{package}.{cmd_name}_command:{cmd_name}_command")
        assert isinstance(command, click.Command)
        return command

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[Any]]:
        """Complete names without importing the commands."""
        found = [
            CompletionItem(name, help=summary)
            for name, summary in self._summaries.items()
            if name.startswith(incomplete)
        ]
        return found + click.Command.shell_complete(self, ctx, incomplete)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """List names and summaries without importing the commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self._summaries.items()))

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a `PdtuiError` becomes one line and exit code 1, a traceback means a bug."""
        try:
            _check_open_files()
            return super().invoke(ctx)
        except PdtuiError as error:
            message = str(error)
        except OSError as error:
            if error.errno not in _NAMES_NO_FILE:
                raise
            message = f"{error.filename}: {error.strerror}"
        except ModuleNotFoundError as error:
            if error.name not in OPTIONAL_ROOMS:
                raise
            message = f"{error.name} is not part of this installation, and the command needs it"
        click.echo(f"pdtui: {make_printable(message)}", err=True)  # it may quote a file
        return ctx.exit(1)


def _check_open_files() -> None:
    allowed, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    if allowed == resource.RLIM_INFINITY or allowed >= LEAST_FILES:
        return
    if most != resource.RLIM_INFINITY and most < LEAST_FILES:
        raise PdtuiError(
            f"expected at least {LEAST_FILES} open files to be allowed (ulimit -n), found {allowed}"
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (LEAST_FILES, most))
