"""`pdtui dissect`: write a map and a report of what a policy's units do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_maps, complete_robots
from pdtui.cli.options.robot_option_flag import parse_robot_options, robot_option_flag
from pdtui.cli.options.shared_options import (
    FILE_PATH,
    import_option_flags,
    integer_option,
    json_option,
    minutes_option,
    overwrite_option,
    own_policy_option,
    preset_option,
    search_seed_option,
)
from pdtui.cli.options.worker_options import workers_option
from pdtui.cli.output.command_output import print_result
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.settings.settings_file import own_folder


@click.command()
@click.argument("robot", required=False, shell_complete=complete_robots)
@click.option(
    "--env",
    metavar="ID",
    help="Instead of ROBOT, an environment registered with Gymnasium, such as Hopper-v5. A module in front "
    "of it (package.module:Name-v0) is imported first.",
)
@robot_option_flag
@own_policy_option
@import_option_flags
@preset_option
@click.option(
    "--set",
    "preset_changes",
    multiple=True,
    metavar="NAME=VALUE",
    help="Change a setting of the preset, such as window=hann or length=32. An unknown name lists them all. "
    "May be repeated.",
)
@integer_option(
    "--episodes", most=1000, default=5, help="Number of episodes in which units and attributes are monitored."
)
@search_seed_option
@click.option(
    "-o",
    "--output",
    type=FILE_PATH,
    metavar="FILE.toml",
    help="File of the map; default: maps/ROBOT-dissected.toml.",
)
@click.option(
    "--quick", is_flag=True, help="Take a first look of about a minute: fewer probes, hardly any search."
)
@click.option(
    "--report",
    type=FILE_PATH,
    metavar="FILE.rrd",
    help="File of the report for the Rerun viewer; default: the map's name with .rrd.",
)
@click.option("--figures", type=FILE_PATH, metavar="FOLDER", help="Also draw figures into this folder.")
@click.option(
    "--figure-format",
    type=click.Choice(["png", "pdf", "svg"]),
    default="png",
    show_default=True,
    help="Format of these figures.",
)
@click.option(
    "--null",
    is_flag=True,
    help="Test the dissection itself: choose and judge where nothing is to be found, and count what is "
    "confirmed. Writes no file.",
)
@overwrite_option
@click.option(
    "--start-from",
    metavar="MAP",
    shell_complete=complete_maps,
    help="Also begin the searches from the behaviors of this map, given by name or file.",
)
@minutes_option("--budget", note=" Every unit is screened even if that takes longer.")
@workers_option
@json_option
def dissect_command(
    robot: str | None,
    env: str | None,
    robot_options: tuple[str, ...],
    policy: str,
    output: Path | None,
    quick: bool,
    report: Path | None,
    figures: Path | None,
    figure_format: str,
    null: bool,
    overwrite: bool,
    budget: float | None,
    as_json: bool,
    **settings: Any,
) -> None:
    """Find the units of ROBOT's policy that steer it, and write a map and a report.

    An interrupted dissection continues where it stopped when the same command is run again.
    """
    from pdtui.dissection.dissect_into_map import WrittenDissection, dissect_into_map
    from pdtui.dissection.dissection_config import QUICK_DISSECTION, DissectionConfig, DissectionSettings
    from pdtui.dissection.null_dissection import NullDissection, count_false_confirmations
    from pdtui.pictures.dissection_report import PictureOutputs
    from pdtui.robots import RobotSpec, require_robot_name, robot_file_stem, trust_module

    if (robot is None) == (env is None):
        raise click.UsageError("expected either ROBOT or --env ID")
    name = str(robot or env)
    trust_module(name)
    world = RobotSpec(name, parse_robot_options(require_robot_name(name), robot_options))
    output = output or own_folder("maps") / f"{robot_file_stem(name)}-dissected.toml"
    outputs = PictureOutputs(report or output.with_suffix(".rrd"), figures, overwrite, figure_format)
    if not null:
        outputs.check()
    with progress_bar("dissecting", quiet=as_json) as advance:

        def show_progress(stage: str, done: int, total: int) -> None:
            if advance is not None:
                advance(done, total, stage)

        config = DissectionConfig(
            world,
            policy or name,
            settings=QUICK_DISSECTION if quick else DissectionSettings(),
            budget_minutes=budget,
            progress=show_progress,
            **settings,
        )
        result: NullDissection | WrittenDissection
        if null:
            result = count_false_confirmations(config)
        else:
            result = dissect_into_map(config, output, overwrite=overwrite, draw=outputs.draw)
    print_result(result.as_dict(), as_json, result.table)
    if isinstance(result, WrittenDissection) and not as_json:
        click.echo(f"wrote {', '.join(map(str, result.pictures))}")
