"""`pdtui sessions`: list, inspect, verify, repair, export, compare and open recorded drives."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_sessions
from pdtui.cli.options.shared_options import FILE_PATH, json_option
from pdtui.cli.output.command_output import print_result
from pdtui.cli.replay_command import replay_options
from pdtui.cli.sessions.export_subcommand import export_command
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.errors import PdtuiError, SessionError
from pdtui.core.printable_text import make_printable, to_json
from pdtui.core.settings.settings_file import own_folder

BROKEN, DIFFERS = 1, 3
"""Exit codes."""
_SHOWN = ("robot", "policy", "seed", "stochastic", "start", "layers", "activations")
_file_argument = click.argument("file", type=FILE_PATH, shell_complete=complete_sessions)


@click.group()
def sessions_command() -> None:
    """List, inspect, verify, repair, export, compare and open sessions."""


sessions_command.add_command(export_command)


@sessions_command.command("list")
@click.argument("folder", type=FILE_PATH, default=lambda: str(own_folder("sessions")))
@json_option
def list_command(folder: Path, as_json: bool) -> None:
    """List the sessions under FOLDER, and say what is wrong with broken ones."""
    from pdtui.cli.output import session_tables

    if not folder.is_dir():
        raise SessionError(f"{folder}: no such folder")
    rows = [_list_row(path) for path in sorted(folder.rglob("*.rrd")) if path.is_file()]
    if not rows and not as_json:
        click.echo(f"no sessions under {make_printable(str(folder))}")
        return
    print_result({"sessions": rows}, as_json, lambda: session_tables.session_list_table(rows, folder))


def _list_row(path: Path) -> dict[str, Any]:
    from pdtui.sessions.session_header import read_session_header
    from pdtui.sessions.writer.session_file import is_being_recorded

    row: dict[str, Any] = {"path": str(path), "bytes": path.stat().st_size, "broken": ""}
    try:
        header = read_session_header(path)
    except SessionError as error:
        return {**row, "broken": str(error).removeprefix(f"{path}: ")}
    return {
        **row,
        "robot": header.info.robot,
        "steps": header.steps,
        "missing": header.missing,
        "seconds": header.seconds,
        "keys": header.keys,
        "outcomes": header.outcome_counts,
        "outcome": header.outcome or "is being recorded" * is_being_recorded(path),
    }


@sessions_command.command()
@_file_argument
@json_option
def show_command(file: Path, as_json: bool) -> None:
    """Show robot, policy, keys, attributes and outcome of FILE."""
    from pdtui.cli.output import session_tables
    from pdtui.sessions.session_header import read_session_header
    from pdtui.sessions.session_summary import read_session_summary

    session = read_session_header(file)
    summary = read_session_summary(session)
    data = {
        "path": str(file),
        "robot_options": dict(session.info.robot_options),
        "policy_sha256": session.info.policy_hash,
        **{name: getattr(session.info, name) for name in _SHOWN},
        "branch": None if session.info.branch is None else asdict(session.info.branch),
        "map": session.info.map_text,
        "created": session.created,
        "outcome": session.outcome,
        "versions": session.versions,
        **asdict(summary),
        "events": [asdict(event) for event in session.events],
        "endings": session.endings,
    }
    print_result(data, as_json, lambda: session_tables.session_details(session, summary))


@sessions_command.command()
@click.argument("files", type=FILE_PATH, nargs=-1, required=True, shell_complete=complete_sessions)
@click.option("--no-replay", is_flag=True, help="Only compare the checksums, which needs no policy.")
@replay_options
@json_option
def verify_command(files: tuple[Path, ...], no_replay: bool, options: dict[str, Any], as_json: bool) -> None:
    """Check that FILES are whole, by their checksums, and that their drives repeat.

    Exit codes: 0 if all pass; 1 if a file is broken, incomplete or cannot be replayed; 3 if a drive does not
    repeat.
    """
    found = [_verify_file(file, None if no_replay else options, as_json) for file in files]
    if as_json:
        click.echo(to_json({"sessions": found}))
    if any(row["repeats"] is False for row in found):
        sys.exit(DIFFERS)
    if not all(row["whole"] and (row["repeats"] or no_replay) for row in found):
        sys.exit(BROKEN)


def _verify_file(file: Path, options: dict[str, Any] | None, as_json: bool) -> dict[str, Any]:
    """Verify a session, with a replay if there are options for it, and print or return what was found."""
    from pdtui.sessions.session_integrity import examine_session

    row: dict[str, Any] = {"path": str(file), "whole": False, "checksums": None, "repeats": None}
    try:
        found = examine_session(file)
        row |= {"whole": found.whole, "checksums": found.sealed}
        row["damage"] = [damaged._asdict() for damaged in found.damage]
        row["missing"] = found.describe_losses()
        lines = [found.verdict, *(f"  {line}" for line in row["missing"])]
        if options is not None:
            from pdtui.driving.session_replay import replay_session

            with progress_bar("replaying", quiet=as_json) as advance:
                result = replay_session(file, progress=advance, **options)
            row |= {"repeats": result.passed, "identical": result.identical, **asdict(result)}
            lines[0] += f"; {result.verdict}"
            if not result.identical:
                lines += [f"  {line}" for line in (*map(str, result.deviations[:5]), *result.environment)]
    except PdtuiError as error:
        row["broken"] = str(error).removeprefix(f"{file}: ")
        lines = [f"broken: {row['broken']}"]
    if not as_json:
        click.echo(make_printable(f"{file}: {lines[0]}"))
        for line in lines[1:]:
            click.echo(make_printable(line))
    return row


@sessions_command.command()
@_file_argument
@click.option(
    "-o", "--output", type=FILE_PATH, metavar="FILE.rrd", help="New file; default: FILE.repaired.rrd."
)
@click.option("--in-place", is_flag=True, help="Replace FILE itself.")
def repair_command(file: Path, output: Path | None, in_place: bool) -> None:
    """Write everything that is whole in FILE as a session that can be opened and replayed."""
    from pdtui.sessions.session_integrity import examine_session
    from pdtui.sessions.session_repair import repair_session

    if in_place and output is not None:
        raise SessionError("--in-place and -o are mutually exclusive")
    if examine_session(file).whole:
        click.echo(f"{make_printable(str(file))}: whole; nothing to repair")
        return
    target = file if in_place else output or file.with_suffix(".repaired.rrd")
    if target.exists() and not in_place:
        raise SessionError(f"{target}: already exists; a repaired session is a new file")
    repaired = repair_session(file, target)
    header = repaired.header
    length = f"{header.steps - header.missing} steps ({header.seconds:g} s), {header.keys} keys"
    click.echo(make_printable(f"wrote {target}: {length}, outcome '{header.outcome}'"))
    for line in repaired.describe_losses():
        click.echo(f"  {line}")


@sessions_command.command()
@click.argument("a", type=FILE_PATH, shell_complete=complete_sessions)
@click.argument("b", type=FILE_PATH, shell_complete=complete_sessions)
@click.option(
    "--figure", type=FILE_PATH, metavar="FILE", help="Also draw both: a new .png, .pdf or .svg file."
)
@json_option
def compare_command(a: Path, b: Path, figure: Path | None, as_json: bool) -> None:
    """Compare sessions A and B step by step, in every stream: two branches of a drive, for example.

    Exit codes: 0 if they are identical; 3 if they differ.
    """
    from pdtui.cli.output import session_tables
    from pdtui.sessions.comparison.session_comparison import compare_sessions
    from pdtui.sessions.drive_path import compare_drive_paths, read_drive_path
    from pdtui.sessions.session_header import read_session_header

    if figure is not None:
        from pdtui.pictures.matplotlib_page import check_figure_path

        check_figure_path(figure, overwrite=False)
    headers = read_session_header(a), read_session_header(b)
    result = compare_sessions(*headers)
    courses = read_drive_path(headers[0]), read_drive_path(headers[1])
    apart = result.first_difference is not None
    paths = compare_drive_paths(*courses, result.first_difference or 0) if apart else ()
    data = {**asdict(result), "paths": [asdict(row) for row in paths]}
    print_result(data, as_json, lambda: session_tables.session_comparison_table(result, headers, paths))
    if figure is not None:
        from pdtui.pictures.session_figure import draw_session_comparison

        draw_session_comparison(figure, headers, courses, result)
        click.echo(make_printable(f"wrote {figure}"), err=True)
    if result.first_difference is not None or result.lengths[0] != result.lengths[1]:
        sys.exit(DIFFERS)


@sessions_command.command("open")
@_file_argument
@click.option("--web", is_flag=True, help="Open it in the browser instead of the viewer's own window.")
def open_command(file: Path, web: bool) -> None:
    """Open FILE in the Rerun viewer, which listens on 127.0.0.1 only."""
    from pdtui.sessions.session_header import read_session_header
    from pdtui.sessions.viewer.viewer_window import show_in_viewer

    read_session_header(file)  # for a file that is no session, the viewer would show an empty window
    show_in_viewer(file, web=web)
