"""What the commands share: options, the drive that they ask for, progress and output."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from pdtui.core.errors import MapError
from pdtui.core.json_text import to_json
from pdtui.core.printable_text import make_printable
from pdtui.policies.weights.import_options import ACTIVATION_NAMES, NO_OPTIONS, SQUASH_NAMES, ImportOptions

if TYPE_CHECKING:
    from pdtui.drive.drive_config import DriveConfig
    from pdtui.stimulation.stimulation_map import StimulationMap


class SeedList(click.ParamType[range]):
    name = "FIRST-LAST"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> range:
        if isinstance(value, range):
            return value
        match = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", str(value))
        if match is None or int(match[2] or match[1]) < int(match[1]):
            self.fail(f"'{value}': expected seeds such as 7 or 100-119", param, ctx)
        return range(int(match[1]), int(match[2] or match[1]) + 1)


map_option = click.option(
    "--map", "map_name", metavar="MAP", help="A map by name or file; default: the robot's."
)
force_option = click.option(
    "--force", is_flag=True, help="Use the map although it was made for another policy."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
overwrite_option = click.option("--overwrite", is_flag=True, help="Replace existing files.")
workers_option = click.option(
    "--workers", type=click.IntRange(1, 256), default=None, help="Processes; default: one a core."
)


def import_option_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """``--activation``, ``--squash`` and ``--normaliser``, given to the command as `import_options`."""

    @wraps(command)
    def choosing(
        *args: Any, activation: str | None, squash: str | None, normaliser: str, **others: Any
    ) -> Any:
        return command(
            *args, import_options=ImportOptions(activation or "", squash or "", normaliser), **others
        )

    for option in (
        click.option(
            "--normaliser", default="", metavar="FILE", help="Statistics of the observation, or 'none'."
        ),
        click.option(
            "--squash",
            type=click.Choice(SQUASH_NAMES),
            help="How the policy's output becomes an action, where its file does not say.",
        ),
        click.option(
            "--activation",
            type=click.Choice(ACTIVATION_NAMES),
            help="Activation function of the hidden layers, where the policy's file does not say.",
        ),
    ):
        choosing = option(choosing)
    return choosing


def policy_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """``--policy`` and the choices that its file may leave open, given as `policy` and `import_options`."""
    return click.option("--policy", default="", help="Weights to use instead of the map's.")(
        import_option_flags(command)
    )


def judging_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """``--tolerance`` and ``--strict``, given to the command as `judging`."""

    @wraps(command)
    def judged(*args: Any, tolerance: float | None, strict: bool, **others: Any) -> Any:
        judging: dict[str, Any] = {"strict": strict}
        if tolerance is not None:
            judging["tolerance"] = tolerance
        return command(*args, judging=judging, **others)

    for option in (
        click.option("--strict", is_flag=True, help="Accept nothing but the same bits, wherever this runs."),
        click.option(
            "--tolerance",
            type=click.FloatRange(0),
            metavar="SPREADS",
            help="On another machine or other versions, attributes may be off by this many standard "
            "deviations of the session in its first 2 s.  [default: 1e-06]",
        ),
    ):
        judged = option(judged)
    return judged


start_option = click.option(
    "--start", default="", metavar="STATE", help="Where episodes start, for a robot with several states."
)


def drive_config(
    robot: str,
    map_name: str | None,
    policy: str,
    import_options: ImportOptions = NO_OPTIONS,
    *,
    seed: int = 0,
    without_map: bool = False,
    **options: Any,
) -> DriveConfig:
    """The drive that the options ask for; `without_map`: of a policy alone, where its robot has no map."""
    from pdtui.drive.drive_config import DriveConfig
    from pdtui.robots import check_robot, file_stem, trust_module
    from pdtui.stimulation.map_library import find_map
    from pdtui.stimulation.map_policy_lookup import resolve_map_policy
    from pdtui.stimulation.map_reader import load_map

    if map_name is None and robot.endswith(".toml"):
        stimulation_map = load_map(find_map(robot))
        robot = stimulation_map.robot
    else:
        # Typed by the user, unlike the name inside a map.
        trust_module(robot)
        check_robot(robot)
        stimulation_map = _map_of(
            robot, map_name or file_stem(robot), policy if without_map and map_name is None else ""
        )
    return DriveConfig(
        check_robot(robot), resolve_map_policy(stimulation_map, policy, import_options), seed, **options
    )


def _map_of(robot: str, name: str, policy: str) -> StimulationMap:
    """The map of this name; none needs to be there for a policy that is to drive alone."""
    from pdtui.stimulation.map_library import bare_map, find_map
    from pdtui.stimulation.map_reader import load_map

    try:
        path = find_map(name)
    except MapError as error:
        if not policy:
            raise
        click.echo(make_printable(f"{error}; driving without behaviors"), err=True)
        return bare_map(robot, policy)
    return load_map(path)


def core_count(workers: int | None) -> int:
    return workers or os.cpu_count() or 1


def show_result(data: dict[str, Any] | list[dict[str, Any]], as_json: bool, table: Callable[[], Any]) -> None:
    """Print the data as JSON, or the table."""
    if as_json:
        click.echo(to_json(data))
        return
    from rich.console import Console

    # Names in tables come from maps and sessions, so nothing in them is markup.
    Console(markup=False, emoji=False).print(table())


def progress_bar_or_none(
    label: str, quiet: bool = False
) -> AbstractContextManager[Callable[..., None] | None]:
    """A progress bar with time left, on standard error; its value is called with done, total, note."""
    if quiet:
        return nullcontext(None)
    from pdtui.core.progress_bar import progress_bar

    return progress_bar(label)
