"""`pdtui drive`: drive a robot on the screen, or without one from a keystroke file."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.completion.completed_names import complete_robots
from pdtui.cli.options.ghost_options import ghost_options
from pdtui.cli.options.robot_option_flag import robot_option_flag
from pdtui.cli.options.screen_options import screen_options
from pdtui.cli.options.shared_options import (
    FILE_PATH,
    build_drive_config,
    force_option,
    import_option_flags,
    integer_option,
    map_option,
    map_policy_option,
    record_activations_option,
    start_option,
)
from pdtui.cli.screen.session_names import record_into_new_session
from pdtui.cli.screen.show_drive import show_drive
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.errors import KeystrokeError, SessionError
from pdtui.core.outcome import describe_outcomes
from pdtui.core.printable_text import make_printable
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.sessions.viewer.viewer_address import LOCAL, PORT, ViewerAddress
from pdtui.sessions.writer.session_file import SYNC_MODES

if TYPE_CHECKING:
    from pdtui.core.settings.user_settings import UserSettings
    from pdtui.driving.drive_config import DriveConfig


@click.command()
@click.argument("robot", shell_complete=complete_robots)
@robot_option_flag
@map_option
@map_policy_option
@ghost_options
@import_option_flags
@force_option
@integer_option("--seed", least=0, most=2**31 - 1, default=0, help="Seed of every random choice.")
@click.option(
    "--stochastic", is_flag=True, help="Draw actions from the policy's distribution instead of its mean."
)
@start_option
@click.option(
    "--record", type=FILE_PATH, metavar="FILE.rrd", help="Session to write; default: a new one in ./sessions."
)
@click.option("--overwrite", is_flag=True, help="Replace the file of --record once the new session is whole.")
@click.option("--no-record", is_flag=True, help="Do not record the drive.")
@click.option(
    "--sync",
    type=click.Choice(SYNC_MODES),
    default="batch",
    show_default=True,
    help="When to force the recording to the disk, in case of a power failure: never, about once a second, "
    "or with every write.",
)
@record_activations_option
@click.option(
    "--viewer",
    is_flag=False,
    flag_value=str(PORT),
    metavar="[PORT|HOST[:PORT]]",
    help=f"Also show the drive in a Rerun viewer that listens at this address; default: {LOCAL}:{PORT}.",
)
@screen_options
@click.option("--step-times", default="", hidden=True)  # for `pdtui bench screen`
@click.option("--headless", is_flag=True, help="Drive without a screen, as fast as possible.")
@click.option(
    "--keys",
    type=FILE_PATH,
    metavar="FILE",
    help="Keystroke file to drive from with --headless; each line is 'STEP KEY' or 'STEP EDIT'.",
)
@integer_option("--steps", default=1000, help="Number of control steps to drive with --headless.")
@click.option(
    "--minutes",
    type=click.FloatRange(0, min_open=True),
    metavar="MINUTES",
    help="End a drive with --headless after this time, with the steps done so far.",
)
def drive_command(
    robot: str,
    map_name: str | None,
    policy: str,
    import_options: ImportOptions,
    record: Path | None,
    overwrite: bool,
    no_record: bool,
    viewer: str | None,
    settings: UserSettings,
    headless: bool,
    keys: Path | None,
    steps: int,
    add_ghost: Callable[[DriveConfig], DriveConfig],
    minutes: float | None,
    **options: Any,
) -> None:
    """Drive ROBOT with the keys of its map. ROBOT may also be a map file."""
    config = build_drive_config(robot, map_name, policy, import_options, without_map=True, **options)
    config = add_ghost(config)
    if record is not None and record.exists() and not overwrite:
        raise SessionError(f"{record}: already exists; --overwrite replaces it")
    if overwrite and record is None:
        raise SessionError("--overwrite needs --record FILE")
    if record is not None and no_record:
        raise SessionError("--record and --no-record are mutually exclusive")
    if record is not None:
        config = replace(config, recording=str(record), existing="replace" if overwrite else "refuse")
    elif not no_record:
        config = record_into_new_session(config)
    if keys is not None and not headless:
        raise KeystrokeError("--keys needs --headless; on the screen, keys are pressed by hand")
    if viewer is not None:
        if no_record:
            raise SessionError("--viewer shows the recording, so it cannot be used with --no-record")
        config = replace(config, viewer=ViewerAddress.parse(viewer))
    if headless:
        _drive_headless(config, keys, steps, minutes)
    else:
        show_drive(config, settings)


def _drive_headless(config: DriveConfig, keys: Path | None, steps: int, minutes: float | None) -> None:
    from pdtui.driving.headless_drive import catch_ending_signals, drive_headless
    from pdtui.driving.keystrokes import read_keystrokes
    from pdtui.driving.loop_builder import build_control_loop
    from pdtui.sessions.writer.recorder_process import RecorderProcess

    presses = read_keystrokes(keys, config.stimulation_map) if keys is not None else {}
    process = RecorderProcess() if config.recording else None  # it loads while the world does
    loop = build_control_loop(config)
    info, viewer = replace(loop.info, activations=config.activations), config.viewer
    if viewer is not None and not viewer.is_listening:
        click.echo(viewer.absence_message, err=True)
        viewer = None
    recorder = None
    if process is not None:
        path, existing = Path(config.recording), config.existing
        recorder = process.begin_recording(path, info, viewer=viewer, existing=existing, sync=config.sync)
    with catch_ending_signals() as ended, progress_bar("driving", quiet=not sys.stderr.isatty()) as advance:
        summary = drive_headless(loop, presses, steps, recorder, ended, progress=advance, minutes=minutes)
    takeover = " or a takeover" if loop.robot.manual_controls else ""
    cost = f"cost {summary.cost:g}, " if summary.cost else ""
    click.echo(
        f"{summary.steps} steps, {summary.seconds:g} s simulated; {describe_outcomes(summary.outcomes)}, "
        f"{cost}steps with a key{takeover} {summary.involvement}"
    )
    means = ", ".join(f"{name} {value:.3g}" for name, value in list(summary.mean.items())[:8])
    click.echo(make_printable(f"mean {means}"))
    if recorder is not None:
        if recorder.notice:
            click.echo(make_printable(recorder.notice), err=True)
        click.echo(make_printable(f"recorded in {recorder.path}"))
