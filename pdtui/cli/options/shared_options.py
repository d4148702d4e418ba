"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.completion.completed_names import complete_maps, complete_policies, complete_starts
from pdtui.cli.options.robot_option_flag import apply_robot_options, parse_robot_options
from pdtui.core.errors import MapError, SeedError
from pdtui.core.printable_text import make_printable
from pdtui.policies.weights.import_options import ACTIVATION_NAMES, NO_OPTIONS, SQUASH_NAMES, ImportOptions
from pdtui.sessions.session_schema import ACTIVATIONS_KEPT
from pdtui.stimulation.seed_ranges import FIRST_SEARCH_SEED, parse_seed_range, require_unused_seeds

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.robots import RobotSpec
    from pdtui.stimulation.stimulation_map import StimulationMap

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class SeedList(click.ParamType[range]):
    """A seed, or a range of seeds such as 100-119."""

    name = "FIRST-LAST"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> range:
        if isinstance(value, range):
            return value
        try:
            return parse_seed_range(str(value))
        except SeedError as error:
            self.fail(str(error), param, ctx)


FILE_PATH = click.Path(path_type=Path)


def integer_option(
    name: str, *, help: str, default: int | None = None, least: int = 1, most: int | None = None
) -> Decorator:
    """Return an option for a whole number."""
    shown = default is not None
    kind = click.IntRange(least, most)
    return click.option(name, type=kind, default=default, show_default=shown, metavar="N", help=help)


def policy_option(instead_of: str) -> Decorator:
    """Return ``--policy``, whose default is described by a phrase."""
    return click.option(
        "--policy",
        default="",
        metavar="FILE",
        shell_complete=complete_policies,
        help=f"Weights file, or name of a shipped policy; default: {instead_of}.",
    )


map_option = click.option(
    "--map",
    "map_name",
    metavar="MAP",
    shell_complete=complete_maps,
    help="Name or file of the map; default: the robot's map.",
)
force_option = click.option(
    "--force", is_flag=True, help="Use the map even if it was made for another policy."
)
map_policy_option = policy_option("the map's policy")
own_policy_option = policy_option("the robot's policy")
preset_option = click.option(
    "--preset",
    type=click.Choice(["paper", "authors"]),
    default="paper",
    show_default=True,
    help="Match units as the paper describes it, or as its authors' code does.",
)
search_seed_option = integer_option(
    "--seed",
    least=FIRST_SEARCH_SEED,
    most=2**31 - 1,
    default=FIRST_SEARCH_SEED,
    help="Seed of every random choice.",
)
start_option = click.option(
    "--start",
    default="",
    metavar="STATE",
    shell_complete=complete_starts,
    help="State in which episodes start, for a robot that has several.",
)
record_activations_option = click.option(
    "--record-activations",
    "activations",
    type=click.Choice(ACTIVATIONS_KEPT),
    default="all",
    show_default=True,
    help="How to record activations: in full, as float16, or only as the overview image. "
    "A replay computes them again.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
overwrite_option = click.option("--overwrite", is_flag=True, help="Replace existing files.")


def journal_option(kept: str, note: str = "") -> Decorator:
    """Return an option for the file with which an interrupted command goes on."""
    return click.option(
        "--journal",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="FILE",
        help=f"Keep the result of each finished {kept}, and do not run again what is there already.{note}",
    )


def minutes_option(name: str, default: float | None = None, note: str = "") -> Decorator:
    """Return an option for the time that a search may take."""
    return click.option(
        name,
        type=click.FloatRange(0, min_open=True),
        default=default,
        show_default=default is not None,
        metavar="MINUTES",
        help=f"End the search after this time with the best found so far.{note}",
    )


def import_option_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--activation``, ``--squash`` and ``--normalizer``; the command gets them as `import_options`."""

    @click.option(
        "--activation",
        type=click.Choice(ACTIVATION_NAMES),
        help="Activation function of the hidden layers, if the policy's file does not state it.",
    )
    @click.option(
        "--squash",
        type=click.Choice(SQUASH_NAMES),
        help="How outputs become actions, if the policy's file does not state it.",
    )
    @click.option(
        "--normalizer", default="", metavar="FILE", help="File with the observation statistics, or 'none'."
    )
    @wraps(command)
    def with_import_options(
        *args: Any, activation: str | None, squash: str | None, normalizer: str, **others: Any
    ) -> Any:
        options = ImportOptions(activation or "", squash or "", normalizer)
        return command(*args, import_options=options, **others)

    return with_import_options


def build_drive_config(
    robot: str,
    map_name: str | None,
    policy: str,
    import_options: ImportOptions = NO_OPTIONS,
    *,
    seed: int = 0,
    without_map: bool = False,
    robot_options: Sequence[str] = (),
    **options: Any,
) -> DriveConfig:
    """Return the drive that the options describe.

    Args:
        robot: name of a robot or environment, or a map file.
        map_name: name or file of the map; None for the robot's.
        policy: weights to use instead of the map's, or an empty string.
        import_options: answers to what the weights file does not state.
        seed: seed of the drive.
        without_map: whether the policy drives alone where the robot has no map of its own for it.
        robot_options: options of the robot as they were typed; they take precedence over the map's.
        options: further fields of `DriveConfig`.
    """
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.robots import RobotSpec, require_robot_name, robot_file_stem, trust_module
    from pdtui.stimulation.map_library import find_map, map_without_behaviors
    from pdtui.stimulation.map_policy_lookup import resolve_map_policy
    from pdtui.stimulation.map_reader import load_map

    if map_name is None and robot.endswith(".toml"):
        stimulation_map = load_map(find_map(robot))
        robot = require_robot_name(stimulation_map.robot)
        typed = parse_robot_options(robot, robot_options)
    else:
        # Typed by the user, unlike the name inside a map.
        trust_module(robot)
        typed = parse_robot_options(require_robot_name(robot), robot_options)
        try:
            path = find_map(map_name or robot_file_stem(robot))
        except MapError as error:
            if map_name is not None or not (without_map and policy):
                raise
            click.echo(make_printable(f"{error}; driving without behaviors"), err=True)
            stimulation_map = map_without_behaviors(robot, policy)
        else:
            stimulation_map = load_map(path)
            drives_alone = map_name is None and without_map and policy and not options.get("force")
            world = RobotSpec(robot, {**stimulation_map.robot_options, **typed})
            if drives_alone and _is_of_another_policy(stimulation_map, world, policy, import_options):
                told = f"{path}: made for another policy than {policy}; driving without behaviors"
                click.echo(make_printable(told), err=True)
                stimulation_map = map_without_behaviors(robot, policy)
    stimulation_map = apply_robot_options(stimulation_map, typed)
    stimulation_map = resolve_map_policy(stimulation_map, policy, import_options)
    return DriveConfig(robot, stimulation_map, seed, **options)


def _is_of_another_policy(
    stimulation_map: StimulationMap, world: RobotSpec, policy: str, import_options: ImportOptions
) -> bool:
    from pdtui.stimulation.choosing.policy_comparison import (
        is_of_another_policy,
    )  # loads torch, so not before

    return is_of_another_policy(stimulation_map, world, policy, import_options)


def check_judging_seeds(config: DriveConfig, seeds: range) -> None:
    """Refuse to judge a map on seeds on which something in it was chosen; warn if it does not say enough."""
    judged = config.stimulation_map
    warning = require_unused_seeds(seeds, judged.seeds, judged.source)
    if warning:
        click.echo(make_printable(warning), err=True)
