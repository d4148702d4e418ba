"""`pdtui pursue`: search for a stimulation with which a robot does a task."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.shared_options import (
    import_option_flags,
    json_option,
    own_policy_option,
    progress_bar_or_none,
    search_seed_option,
    show_result,
    workers_option,
)
from pdtui.policies.weights.import_options import ImportOptions


@click.command()
@click.argument("robot")
@click.argument("task")
@own_policy_option
@import_option_flags
@search_seed_option
@click.option(
    "--minutes",
    type=click.FloatRange(0, min_open=True),
    default=10.0,
    show_default=True,
    help="End the search after this time with the best found so far. Every unit is tried even if that takes "
    "longer.",
)
@click.option("--quick", is_flag=True, help="Take a first look: few units, hardly any search.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE.toml",
    help="The map to write the behavior into, new or of the same policy; default: maps/ROBOT-dissected.toml.",
)
@workers_option
@json_option
def pursue(
    robot: str,
    task: str,
    policy: str,
    import_options: ImportOptions,
    seed: int,
    minutes: float,
    quick: bool,
    output: Path | None,
    workers: int,
    as_json: bool,
) -> None:
    """Search for a stimulation with which ROBOT does TASK, and write it into a map.

    For example, `pdtui pursue walker hop`.
    """
    from pdtui.dissection.search_task_into_map import search_task_into_map
    from pdtui.robots import file_stem
    from pdtui.search.task_search import QUICK_TASK_SEARCH, TaskSearchSettings

    with progress_bar_or_none("pursuing", quiet=as_json) as advance:
        found = search_task_into_map(
            robot,
            task,
            policy or robot,
            output or Path("maps") / f"{file_stem(robot)}-dissected.toml",
            import_options=import_options,
            seed=seed,
            workers=workers,
            minutes=minutes,
            settings=QUICK_TASK_SEARCH if quick else TaskSearchSettings(),
            progress=advance,
        )
    show_result(found.as_dict(), as_json, found.text)
