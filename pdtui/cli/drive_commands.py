"""The commands `pdtui drive` and `pdtui replay`."""

from __future__ import annotations

import sys
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.shared_options import (
    criteria_options,
    drive_config,
    force_option,
    map_option,
    policy_options,
    progress_bar_or_none,
    start_option,
)
from pdtui.core.errors import KeystrokeError, ScreenError, SessionError
from pdtui.core.printable_text import make_printable
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.sessions.session_schema import ACTIVATIONS_KEPT, ActivationsKept
from pdtui.sessions.viewer.viewer_address import LOCAL, PORT, ViewerAddress

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig


@click.command()
@click.argument("robot")
@map_option
@policy_options
@force_option
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True)
@click.option(
    "--stochastic", is_flag=True, help="Draw actions from the policy's distribution instead of its mean."
)
@start_option
@click.option(
    "--record",
    type=click.Path(path_type=Path),
    help="Session file to write; by default a new one in ./sessions.",
)
@click.option("--no-record", is_flag=True, help="Do not record the drive.")
@click.option(
    "--record-activations",
    "activations",
    type=click.Choice(ACTIVATIONS_KEPT),
    default="all",
    show_default=True,
    help="How to record activations: in full, as float16, or only as the overview image. "
    "A replay computes them again.",
)
@click.option(
    "--viewer",
    is_flag=False,
    flag_value=str(PORT),
    metavar="[PORT|HOST[:PORT]]",
    help=f"Also show the drive in a Rerun viewer that listens at this address (default {LOCAL}:{PORT}).",
)
@click.option("--fps", type=click.IntRange(1, 60), default=12, show_default=True, help="Frames per second.")
@click.option("--headless", is_flag=True, help="Drive without a screen from --keys, as fast as possible.")
@click.option(
    "--keys",
    type=click.Path(path_type=Path),
    help="Keystroke file to drive from, with one 'STEP KEY' per line.",
)
@click.option(
    "--steps",
    type=click.IntRange(1),
    default=1000,
    show_default=True,
    help="Number of control steps with --headless.",
)
def drive(
    robot: str,
    map_name: str | None,
    policy: str,
    import_options: ImportOptions,
    force: bool,
    seed: int,
    stochastic: bool,
    start: str,
    record: Path | None,
    no_record: bool,
    activations: ActivationsKept,
    viewer: str | None,
    fps: int,
    headless: bool,
    keys: Path | None,
    steps: int,
) -> None:
    """Drive ROBOT with the keys of its map. ROBOT may also be a map file."""
    config = drive_config(
        robot,
        map_name,
        policy,
        import_options,
        force=force,
        seed=seed,
        stochastic=stochastic,
        start=start,
        activations=activations,
        without_map=True,
    )
    if record is not None and record.exists():
        raise SessionError(f"{record}: exists already; a drive is recorded into a new file")
    if keys is not None and not headless:
        raise KeystrokeError("--keys needs --headless; on the screen, keys are pressed by hand")
    if viewer is not None:
        if no_record or (headless and record is None):
            raise SessionError("--viewer shows what is recorded: add --record FILE, or leave --no-record out")
        config = replace(config, viewer=ViewerAddress.parse(viewer))
    if headless:
        _drive_headless(config, keys, steps, record)
    else:
        path = None if no_record else record or _new_session(config)
        _drive_on_screen(config, path, fps)


@click.command()
@click.argument("session", type=click.Path(path_type=Path))
@click.option("--watch", is_flag=True, help="Show the replay on the screen.")
@click.option("--policy", default="", help="The session's weights file, if it has moved.")
@criteria_options
def replay(session: Path, watch: bool, policy: str, criteria: dict[str, Any]) -> None:
    """Run SESSION again and compare every step. Exits with 1 if it does not repeat."""
    from pdtui.driving.replay import replay_config, replay_session

    if watch:
        from pdtui.sessions.session_reader import read_session

        recorded = read_session(session)
        if recorded.steps == 0:
            raise SessionError(f"{session}: no control step is recorded, so there is nothing to watch")
        _show(replay_config(recorded, str(session), policy), fps=12, watching=True)
        return
    with progress_bar_or_none("replaying") as advance:
        result = replay_session(session, policy=policy, progress=advance, **criteria)
    click.echo(make_printable(result.verdict), err=not result.passed)
    if not result.identical:
        lines = [*(str(deviation) for deviation in result.deviations[:5]), *result.environment]
        for line in lines:
            click.echo(f"  {make_printable(line)}", err=True)
    if not result.passed:
        sys.exit(1)


def _new_session(config: DriveConfig) -> Path:
    from pdtui.robots import file_stem

    return (
        Path("sessions") / f"{file_stem(config.robot)}-{datetime.now():%Y%m%d-%H%M%S}-seed{config.seed}.rrd"
    )


def _drive_headless(config: DriveConfig, keys: Path | None, steps: int, record: Path | None) -> None:
    from pdtui.driving.ending_signals import catch_ending_signals
    from pdtui.driving.headless_drive import drive_headless
    from pdtui.driving.keystrokes import read_keystrokes
    from pdtui.driving.loop_builder import build_loop
    from pdtui.sessions.writer.session_recorder import SessionRecorder

    presses = read_keystrokes(keys, config.stimulation_map) if keys is not None else {}
    loop = build_loop(config)
    info, viewer = replace(loop.info, activations=config.activations), config.viewer
    if viewer is not None and not viewer.is_listening:
        click.echo(viewer.absence_message, err=True)
        viewer = None
    recorder = SessionRecorder(record, info, viewer=viewer) if record is not None else None
    with catch_ending_signals() as ended:
        summary = drive_headless(loop, presses, steps, recorder, ended)
    click.echo(
        f"{summary.steps} steps, {summary.seconds:g} s simulated; falls {summary.falls}, "
        f"steps with a key {summary.involvement}"
    )
    means = ", ".join(f"{name} {value:.3g}" for name, value in list(summary.mean.items())[:8])
    click.echo(make_printable(f"mean {means}"))
    if record is not None:
        click.echo(make_printable(f"recorded in {record}"))


def _drive_on_screen(config: DriveConfig, recording: Path | None, fps: int) -> None:
    if recording is not None:
        config = replace(config, recording=str(recording))
    _show(config, fps=fps)


def _show(config: DriveConfig, *, fps: int, watching: bool = False) -> None:
    """Start the simulation's process, then show it on the screen."""
    _check_terminal()
    from pdtui.driving.client import DriveClient

    connection = DriveClient(config)
    try:
        from pdtui.tui.drive_app import DriveApp

        app = DriveApp(connection, config.stimulation_map, fps=fps, watching=watching)
        message = app.run()
    finally:
        last_words = connection.close()
    if app.return_code or connection.failed:
        said = message or last_words
        raise ScreenError(said if config.recording in said else f"{said}; {last_words}")
    click.echo(make_printable(last_words))


def pick_and_drive() -> None:
    _check_terminal()
    from pdtui.stimulation.map_library import list_maps
    from pdtui.tui.map_picker import MapPickerApp, map_picker_rows

    chosen = MapPickerApp(map_picker_rows(list_maps())).run()
    if chosen is not None:
        config = drive_config(str(chosen), None, "")
        _drive_on_screen(config, _new_session(config), 12)


def _check_terminal() -> None:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise ScreenError("the screen needs a terminal; use --headless to drive without one")
