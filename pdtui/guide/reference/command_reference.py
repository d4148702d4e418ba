"""The page of the guide that lists every command, from click's own declarations."""

from __future__ import annotations

from collections.abc import Iterator

import click

from pdtui.guide.reference import escape_markdown

_HEAD = """\
# Commands

Every command prints this text with `--help`. A command that fails prints one line that says why, and exits
with 1.
"""


def render_command_reference(program: click.Group, name: str) -> str:
    """Return the Markdown of every command of a program, subcommands after their group."""
    context = click.Context(program, info_name=name, **program.context_settings)
    return "\n".join([_HEAD, *_sections(program, context)])


def _sections(command: click.Command, context: click.Context) -> Iterator[str]:
    yield _section(command, context)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            subcommand = command.get_command(context, name)
            assert subcommand is not None
            yield from _sections(subcommand, click.Context(subcommand, parent=context, info_name=name))


def _section(command: click.Command, context: click.Context) -> str:
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    lines = [f"## {context.command_path}", "", "```text", usage, "```", ""]
    for paragraph in filter(str.strip, (command.help or "").split("\n\n")):
        lines += [escape_markdown(" ".join(paragraph.split())), ""]
    records = [parameter.get_help_record(context) for parameter in command.get_params(context)]
    options = [record for record in records if record is not None and "--help" not in record[0]]
    lines += [f"- `{names}`: {escape_markdown(says)}" if says else f"- `{names}`" for names, says in options]
    return "\n".join([*lines, ""] if options else lines)
