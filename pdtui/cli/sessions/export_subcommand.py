"""`pdtui sessions export`: the streams of a session as tables, or its keystrokes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.completion.completed_names import complete_sessions
from pdtui.cli.options.shared_options import FILE_PATH, overwrite_option, policy_option
from pdtui.core.atomic_file import write_file
from pdtui.core.errors import SessionError
from pdtui.core.printable_text import make_printable
from pdtui.sessions.session_schema import EXPORT_FORMATS, LEROBOT

if TYPE_CHECKING:
    from pdtui.sessions.session_header import SessionHeader


@click.command("export")
@click.argument("file", type=FILE_PATH, shell_complete=complete_sessions)
@click.option(
    "--stream",
    metavar="NAME",
    help="Stream to export, or 'all'. Without --stream and --keys, list the streams.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice((*EXPORT_FORMATS, LEROBOT)),
    help="Format of the table; default: from the file's extension. MCAP needs pip install 'pdtui[export]'. "
    "'lerobot' writes the session as a LeRobot dataset into a folder, without --stream.",
)
@click.option(
    "-o",
    "--output",
    type=FILE_PATH,
    metavar="FILE|FOLDER",
    help="File to write the stream into: .parquet, .csv or .mcap. All streams as Parquet or CSV get a folder "
    "with a file for each.",
)
@click.option("--keys", type=FILE_PATH, metavar="FILE", help="Text file to write the keystrokes into.")
@policy_option("the session's policy, which is needed to compute the observations")
@overwrite_option
def export_command(
    file: Path,
    stream: str | None,
    form: str | None,
    output: Path | None,
    keys: Path | None,
    policy: str,
    overwrite: bool,
) -> None:
    """Export streams of FILE as tables, or its keystrokes as text.

    `pdtui drive --headless --keys` reads the keystrokes.
    """
    from pdtui.sessions.export.export_streams import STREAMS
    from pdtui.sessions.export.export_writer import export_all_streams, export_stream

    if form == LEROBOT:
        if output is None or stream is not None:
            raise SessionError("--format lerobot needs -o FOLDER, and takes no --stream")
    elif (stream is None) != (output is None):
        raise SessionError("--stream and -o must be given together")

    def observe(header: SessionHeader) -> Iterator[tuple[Any, Any]]:
        from pdtui.driving.replays.replayed_observations import replay_observations

        return replay_observations(header, policy)

    if form == LEROBOT and output is not None:
        from pdtui.sessions.export.lerobot.lerobot_dataset import export_lerobot_dataset

        episodes, steps = export_lerobot_dataset(file, output, overwrite=overwrite, observe=observe)
        click.echo(make_printable(f"wrote {output}: {episodes} episodes, {steps} control steps"))
    elif stream is not None and output is not None:
        export: dict[str, Any] = {"form": form, "overwrite": overwrite, "observe": observe}
        if stream == "all":
            rows = export_all_streams(file, output, **export)
            told = f"rows: {', '.join(f'{name} {count}' for name, count in rows.items())}"
        else:
            told = f"{export_stream(file, stream, output, **export)} rows"
        click.echo(make_printable(f"wrote {output}: {told}"))
    if keys is not None:
        _export_keys(file, keys, overwrite)
    if stream is None and keys is None and form != LEROBOT:
        for name, one in STREAMS.items():
            click.echo(f"{name:<12} {one.says}")


def _export_keys(file: Path, output: Path, overwrite: bool) -> None:
    from pdtui.driving.keystrokes import format_keystrokes
    from pdtui.sessions.session_header import read_session_header

    if output.exists() and not overwrite:
        raise SessionError(f"{output}: already exists; --overwrite replaces it")
    header = read_session_header(file)
    write_file(output, format_keystrokes(header.events), SessionError)
    without = len(header.events) - header.keys
    note = f"; left out {without} events without a key" if without else ""
    click.echo(make_printable(f"wrote {output}: {header.keys} keys of {header.steps} steps{note}"))
