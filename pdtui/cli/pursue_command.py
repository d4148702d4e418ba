"""`pdtui pursue`: search for a stimulation with which a robot does a task."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_robots, complete_tasks
from pdtui.cli.options.robot_option_flag import parse_robot_options, robot_option_flag
from pdtui.cli.options.shared_options import (
    FILE_PATH,
    import_option_flags,
    integer_option,
    journal_option,
    json_option,
    minutes_option,
    own_policy_option,
    search_seed_option,
)
from pdtui.cli.options.worker_options import workers_option
from pdtui.cli.output.command_output import print_result
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.settings.settings_file import own_folder


@click.command()
@click.argument("robot", shell_complete=complete_robots)
@click.argument("task", shell_complete=complete_tasks)
@robot_option_flag
@own_policy_option
@import_option_flags
@search_seed_option
@minutes_option("--minutes", 10.0, " Every unit is tried even if that takes longer.")
@click.option("--quick", is_flag=True, help="Take a first look: few units, hardly any search.")
@integer_option("--units", help="Try only the N units that change the policy's action most; default: all.")
@click.option(
    "--onset",
    is_flag=True,
    help="Also search for the phase of the gait at which the behavior should begin once its key is pressed.",
)
@click.option(
    "-o",
    "--output",
    type=FILE_PATH,
    metavar="FILE.toml",
    help="Map to write the behavior into, new or of the same policy; default: maps/ROBOT-dissected.toml.",
)
@journal_option("roll-out")
@workers_option
@json_option
def pursue_command(
    robot: str,
    task: str,
    robot_options: tuple[str, ...],
    policy: str,
    quick: bool,
    units: int | None,
    onset: bool,
    output: Path | None,
    as_json: bool,
    **search: Any,
) -> None:
    """Search for a stimulation that makes ROBOT accomplish TASK, and write it into a map.

    For example, `pdtui pursue walker hop`.
    """
    from pdtui.dissection.search_task_into_map import search_task_into_map
    from pdtui.robots import RobotSpec, robot_file_stem
    from pdtui.search.task_search_settings import QUICK_TASK_SEARCH, TaskSearchSettings

    settings = replace(QUICK_TASK_SEARCH if quick else TaskSearchSettings(), onset=onset)
    world = RobotSpec(robot, parse_robot_options(robot, robot_options))
    with progress_bar("pursuing", quiet=as_json) as advance:
        found = search_task_into_map(
            world,
            task,
            policy or robot,
            output or own_folder("maps") / f"{robot_file_stem(robot)}-dissected.toml",
            settings=settings if units is None else replace(settings, screen_units=units),
            progress=advance,
            **search,
        )
    print_result(found.as_dict(), as_json, found.text)
