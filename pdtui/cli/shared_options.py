"""Options and output that several commands share."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from pdtui.core.errors import MapError
from pdtui.core.printable_text import make_printable, to_json
from pdtui.policies.weights.import_options import ACTIVATION_NAMES, NO_OPTIONS, SQUASH_NAMES, ImportOptions

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.stimulation.stimulation_map import StimulationMap


class SeedList(click.ParamType[range]):
    """A seed, or a range of seeds such as 100-119."""

    name = "FIRST-LAST"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> range:
        if isinstance(value, range):
            return value
        match = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", str(value))
        if match is None or int(match[2] or match[1]) < int(match[1]):
            self.fail(f"'{value}': expected seeds such as 7 or 100-119", param, ctx)
        return range(int(match[1]), int(match[2] or match[1]) + 1)


map_option = click.option(
    "--map", "map_name", metavar="MAP", help="Name or file of the map; default: the robot's map."
)
force_option = click.option(
    "--force", is_flag=True, help="Use the map even if it was made for another policy."
)
own_policy_option = click.option(
    "--policy", default="", help="Weights file or shipped policy; default: the robot's policy."
)
search_seed_option = click.option(
    "--seed",
    type=click.IntRange(1000, 2**31 - 1),  # evaluations use the seeds below
    default=1000,
    show_default=True,
    help="Seed of every random choice.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
overwrite_option = click.option("--overwrite", is_flag=True, help="Replace existing files.")
workers_option = click.option(
    "--workers",
    type=click.IntRange(1, 256),
    default=lambda: os.cpu_count() or 1,
    help="Worker processes; default: one per core.",
)


def import_option_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--activation``, ``--squash`` and ``--normaliser``; the command gets them as `import_options`."""

    @wraps(command)
    def choosing(
        *args: Any, activation: str | None, squash: str | None, normaliser: str, **others: Any
    ) -> Any:
        return command(
            *args, import_options=ImportOptions(activation or "", squash or "", normaliser), **others
        )

    for option in (
        click.option(
            "--normaliser",
            default="",
            metavar="FILE",
            help="File with the observation statistics, or 'none'.",
        ),
        click.option(
            "--squash",
            type=click.Choice(SQUASH_NAMES),
            help="How outputs become actions, if the policy's file does not say.",
        ),
        click.option(
            "--activation",
            type=click.Choice(ACTIVATION_NAMES),
            help="Activation function of the hidden layers, if the policy's file does not say.",
        ),
    ):
        choosing = option(choosing)
    return choosing


def policy_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--policy`` and the options of `import_option_flags`."""
    return click.option("--policy", default="", metavar="FILE", help="Weights to use instead of the map's.")(
        import_option_flags(command)
    )


def criteria_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--tolerance`` and ``--strict``; the command gets them as `criteria`."""

    @wraps(command)
    def judged(*args: Any, tolerance: float | None, strict: bool, **others: Any) -> Any:
        criteria: dict[str, Any] = {"strict": strict}
        if tolerance is not None:
            criteria["tolerance"] = tolerance
        return command(*args, criteria=criteria, **others)

    for option in (
        click.option("--strict", is_flag=True, help="Accept only identical bits, on any machine."),
        click.option(
            "--tolerance",
            type=click.FloatRange(0),
            metavar="SPREADS",
            help="On another machine or with other versions, accept attributes that differ by at most this "
            "many of their standard deviations in the first 5 control steps.  [default: 5e-06]",
        ),
    ):
        judged = option(judged)
    return judged


start_option = click.option(
    "--start",
    default="",
    metavar="STATE",
    help="State in which episodes start, for a robot that has several.",
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
    """Return the drive that the options describe.

    Args:
        robot: name of a robot or environment, or a map file.
        map_name: name or file of the map; None for the robot's.
        policy: weights to use instead of the map's, or an empty string.
        import_options: what the file of the weights leaves open.
        seed: seed of the drive.
        without_map: whether a robot without a map may be driven by its policy alone.
        options: further fields of `DriveConfig`.

    Raises:
        PdtuiError: the robot or the map does not exist or cannot be read.
    """
    from pdtui.driving.drive_config import DriveConfig
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
    """Return the map of this name, or an empty one if there is none but a policy is given."""
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
    """Return a context manager for a progress bar on standard error, or for None where `quiet`."""
    if quiet:
        return nullcontext(None)
    from pdtui.cli.progress_bar import progress_bar

    return progress_bar(label)
