"""The commands; each calls a room and prints what it says.

Heavy libraries load only where a command needs them.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui import __version__
from pdtui.errors import EventError, PdtuiError, ScreenError

if TYPE_CHECKING:
    from pdtui.teleop.order import DriveOrder


class _Group(click.Group):
    """Prints a `PdtuiError` as one line and exits with 1; a traceback is for bugs."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except PdtuiError as error:
            click.echo(f"pdtui: {error}", err=True)
            ctx.exit(1)


class _Seeds(click.ParamType[range]):
    name = "FIRST-LAST"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> range:
        if isinstance(value, range):
            return value
        match = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", str(value))
        if match is None or int(match[2] or match[1]) < int(match[1]):
            self.fail(f"'{value}': expected seeds such as 7 or 100-119", param, ctx)
        return range(int(match[1]), int(match[2] or match[1]) + 1)


_map_option = click.option(
    "--map", "map_name", metavar="MAP", help="A map by name or file; default: the robot's."
)
_policy_option = click.option("--policy", default="", help="Weights to use instead of the map's.")
_force_option = click.option(
    "--force", is_flag=True, help="Use the map although it was made for another policy."
)
_json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
_workers_option = click.option(
    "--workers", type=click.IntRange(1, 256), default=None, help="Processes; default: one a core."
)


@click.group(cls=_Group, invoke_without_command=True)
@click.version_option(__version__)
@click.pass_context
def main(ctx: click.Context) -> None:
    """Drive a trained neural controller by stimulating its hidden units.

    Without a command, pick a robot and a map and drive.
    """
    if ctx.invoked_subcommand is None:
        _pick_and_drive()


@main.command()
@click.argument("robot")
@_map_option
@_policy_option
@_force_option
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True)
@click.option(
    "--stochastic", is_flag=True, help="Draw actions from the policy's distribution instead of its mean."
)
@click.option(
    "--record", type=click.Path(path_type=Path), help="Session file; default: a new one in ./sessions."
)
@click.option("--no-record", is_flag=True, help="Do not record.")
@click.option("--fps", type=click.IntRange(1, 60), default=12, show_default=True, help="Frames a second.")
@click.option("--headless", is_flag=True, help="No screen: drive from --keys, as fast as it goes.")
@click.option("--keys", type=click.Path(path_type=Path), help="Keystrokes to drive from: lines 'STEP KEY'.")
@click.option(
    "--steps", type=click.IntRange(1), default=1000, show_default=True, help="Control steps, with --headless."
)
def drive(
    robot: str,
    map_name: str | None,
    policy: str,
    force: bool,
    seed: int,
    stochastic: bool,
    record: Path | None,
    no_record: bool,
    fps: int,
    headless: bool,
    keys: Path | None,
    steps: int,
) -> None:
    """Drive ROBOT with its map's keys; ROBOT may be a map's file, too."""
    order = _order(robot, map_name, policy, force=force, seed=seed, stochastic=stochastic)
    if keys is not None and not headless:
        raise EventError("--keys needs --headless; on the screen, you press them")
    if headless:
        _drive_headless(order, keys, steps, record)
    else:
        path = None if no_record else record or _new_session(order)
        _drive_on_screen(order, path, fps)


@main.command()
@click.argument("session", type=click.Path(path_type=Path))
@click.option("--watch", is_flag=True, help="Show it on the screen.")
@click.option("--policy", default="", help="The session's weights, where they are elsewhere now.")
def replay(session: Path, watch: bool, policy: str) -> None:
    """Run SESSION again and compare every step; exit with 1 at the first that differs."""
    from pdtui.teleop.replay import order_of, replay_session

    if watch:
        from pdtui.sessions.reader import read_session

        _show(order_of(read_session(session), str(session), policy), fps=12, watching=True)
        return
    with _progress("replaying") as advance:
        result = replay_session(session, policy=policy, progress=advance)
    if result.first_difference is None:
        click.echo(f"identical: {result.steps} steps")
        return
    click.echo(f"differs: step {result.first_difference} of {session}: {result.detail}", err=True)
    for line in result.environment:
        click.echo(f"  {line}", err=True)
    sys.exit(1)


@main.command()
@click.argument("robot")
@_map_option
@_policy_option
@_force_option
@click.option("--seeds", type=_Seeds(), default="100-119", show_default=True)
@click.option(
    "--target", metavar="ATTRIBUTE", help="Measure how precisely a target of this attribute is held."
)
@click.option(
    "--policy-only", is_flag=True, help="Measure the policy without any behavior: 1000 steps a seed."
)
@_workers_option
@_json_option
def evaluate(
    robot: str,
    map_name: str | None,
    policy: str,
    force: bool,
    seeds: range,
    target: str | None,
    policy_only: bool,
    workers: int | None,
    as_json: bool,
) -> None:
    """Measure what every behavior of ROBOT's map does, against the default."""
    from pdtui.experiments import evaluate as behaviors
    from pdtui.experiments import tables, tracking, walking

    order = _order(robot, map_name, policy, force=force)
    if target is not None:
        with _progress("holding targets", quiet=as_json) as advance:
            tracked = tracking.evaluate_tracking(order, target, seeds, progress=advance)
        _print(asdict(tracked), as_json, lambda: tables.tracking_table(tracked))
    elif policy_only:
        with _progress("walking", quiet=as_json) as advance:
            walked = walking.evaluate_walking(order, seeds, progress=advance)
        _print(asdict(walked), as_json, lambda: tables.walking_table(walked))
    else:
        with _progress("evaluating", quiet=as_json) as advance:
            result = behaviors.evaluate_map(order, seeds, workers=_cores(workers), progress=advance)
        _print(result.as_dict(), as_json, lambda: tables.behavior_table(result))


@main.command()
@click.argument("robot")
@click.option("--policy", default="", help="Weights to dissect; default: the robot's shipped policy.")
@click.option("--preset", type=click.Choice(["paper", "authors"]), default="paper", show_default=True)
@click.option("--episodes", type=click.IntRange(1, 1000), default=5, show_default=True)
@click.option("--seed", type=click.IntRange(1000, 2**31 - 1), default=1000, show_default=True)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The map; default: maps/ROBOT-dissected.toml."
)
@_workers_option
@_json_option
def dissect(
    robot: str,
    policy: str,
    preset: str,
    episodes: int,
    seed: int,
    output: Path | None,
    workers: int | None,
    as_json: bool,
) -> None:
    """Find the units that steer ROBOT: match, then probe, then write a map."""
    from pdtui.dissection.command import dissect_to_map

    with _progress("dissecting", quiet=as_json) as advance:
        result = dissect_to_map(
            robot,
            policy or robot,
            output or Path("maps") / f"{robot}-dissected.toml",
            preset=preset,
            episodes=episodes,
            seed=seed,
            workers=_cores(workers),
            progress=advance,
        )
    _print(result.as_dict(), as_json, result.table)


@main.command()
@click.argument("robot")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True)
@click.option("--steps", type=click.IntRange(1), default=None, help="Control steps over all worlds.")
@click.option("--algorithm", type=click.Choice(["ppo", "sac"]), default="ppo", show_default=True)
@click.option("--learning-rate", type=click.FloatRange(0, min_open=True), default=None, help="At the start.")
@click.option("--forward", type=click.Choice(["either", "x"]), default="x", show_default=True)
@click.option("--folder", type=click.Path(path_type=Path), help="Checkpoints; default: runs/ROBOT-seed.")
def train(
    robot: str,
    algorithm: str,
    seed: int,
    steps: int | None,
    learning_rate: float | None,
    forward: str,
    folder: Path | None,
) -> None:
    """Train a policy for ROBOT; the same line again goes on where a killed run stopped."""
    from pdtui.training.command import train_policy

    with _progress("training") as advance:
        path = train_policy(
            robot,
            algorithm,
            seed,
            steps,
            learning_rate,
            forward,
            folder or Path("runs") / f"{robot}-{algorithm}-{forward}-{seed}",
            advance,
        )
    click.echo(f"best weights: {path}")


@main.group()
def bench() -> None:
    """Measure speed: ratios of one run, side by side."""


@bench.command("loop")
@click.argument("robot")
@_map_option
@click.option(
    "--steps", type=click.IntRange(100), default=1500, show_default=True, help="Control steps a round."
)
@_json_option
def bench_loop_command(robot: str, map_name: str | None, steps: int, as_json: bool) -> None:
    """Control steps a second of ROBOT: bare, with policy, stimulated, recorded."""
    from pdtui.experiments import bench as benchmark
    from pdtui.experiments import tables

    order = _order(robot, map_name, "")
    with _progress("measuring", quiet=as_json) as advance:
        result = benchmark.bench_loop(order, steps=steps, progress=advance)
    _print(asdict(result), as_json, lambda: tables.bench_table(result))


def _order(robot: str, map_name: str | None, policy: str, *, seed: int = 0, **options: Any) -> DriveOrder:
    from pdtui.robots import check_robot
    from pdtui.stimulation.library import find_map
    from pdtui.stimulation.mapfile import load_map
    from pdtui.teleop.order import DriveOrder

    if map_name is None and robot.endswith(".toml"):
        stimulation_map = load_map(find_map(robot))
        robot = stimulation_map.robot
    else:
        check_robot(robot)
        stimulation_map = load_map(find_map(map_name or robot))
    return DriveOrder(check_robot(robot), stimulation_map, seed, policy, **options)


def _cores(workers: int | None) -> int:
    import os

    return workers or os.cpu_count() or 1


def _new_session(order: DriveOrder) -> Path:
    from datetime import datetime

    return Path("sessions") / f"{order.robot}-{datetime.now():%Y%m%d-%H%M%S}-seed{order.seed}.rrd"


def _drive_headless(order: DriveOrder, keys: Path | None, steps: int, record: Path | None) -> None:
    from pdtui.sessions.recorder import SessionRecorder
    from pdtui.teleop.drive import build_loop, drive_headless
    from pdtui.teleop.keys import read_keystrokes

    presses = read_keystrokes(keys, order.stimulation_map) if keys is not None else {}
    loop = build_loop(order)
    recorder = SessionRecorder(record, loop.info) if record is not None else None
    summary = drive_headless(loop, presses, steps, recorder)
    click.echo(
        f"{summary.steps} steps, {summary.seconds:g} s simulated; falls {summary.falls}, "
        f"steps with a key {summary.involvement}"
    )
    click.echo("mean " + ", ".join(f"{name} {value:.3g}" for name, value in list(summary.mean.items())[:8]))
    if record is not None:
        click.echo(f"recorded in {record}")


def _drive_on_screen(order: DriveOrder, recording: Path | None, fps: int) -> None:
    from dataclasses import replace

    if recording is not None:
        order = replace(order, recording=str(recording))
    _show(order, fps=fps)


def _show(order: DriveOrder, *, fps: int, watching: bool = False) -> None:
    """Run the screen over a simulation in its own process, which starts first."""
    _check_terminal()
    from pdtui.teleop.process import ProcessLink

    link = ProcessLink(order)
    try:
        from pdtui.tui.app import DriveApp

        app = DriveApp(link, order.stimulation_map, fps=fps, watching=watching)
        message = app.run()
    finally:
        last_words = link.close()
    if app.return_code:
        raise ScreenError(message or last_words)
    click.echo(last_words)


def _pick_and_drive() -> None:
    _check_terminal()
    from pdtui.stimulation.library import list_maps
    from pdtui.tui.picker import PickerApp, rows_of

    chosen = PickerApp(rows_of(list_maps())).run()
    if chosen is not None:
        order = _order(str(chosen), None, "")
        _drive_on_screen(order, _new_session(order), 12)


def _check_terminal() -> None:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise ScreenError("no terminal: the screen needs one; --headless drives without")


def _print(data: dict[str, Any], as_json: bool, table: Callable[[], Any]) -> None:
    if as_json:
        click.echo(json.dumps(data, indent=2))
        return
    from rich.console import Console

    Console().print(table())


def _progress(label: str, quiet: bool = False) -> AbstractContextManager[Callable[..., None] | None]:
    """A progress bar with time left, on standard error; its value is called with done, total, note."""
    if quiet:
        return nullcontext(None)
    from pdtui.progress import progress_bar

    return progress_bar(label)
