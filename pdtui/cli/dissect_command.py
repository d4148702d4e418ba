"""`pdtui dissect`: write a map and a report of what a policy's units do."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.shared_options import (
    import_option_flags,
    json_option,
    overwrite_option,
    own_policy_option,
    progress_bar_or_none,
    search_seed_option,
    show_result,
    workers_option,
)
from pdtui.policies.weights.import_options import ImportOptions


@click.command()
@click.argument("robot", required=False)
@click.option(
    "--env",
    metavar="ID",
    help="Instead of ROBOT, an environment registered with Gymnasium, such as Hopper-v5. A module in front "
    "of it (package.module:Name-v0) is imported first.",
)
@own_policy_option
@import_option_flags
@click.option(
    "--preset",
    type=click.Choice(["paper", "authors"]),
    default="paper",
    show_default=True,
    help="Match units as the paper describes it, or as its authors' code does.",
)
@click.option(
    "--set",
    "preset_changes",
    multiple=True,
    metavar="NAME=VALUE",
    help="Change a setting of the preset, such as window=hann or length=32. An unknown name lists them all. "
    "May be repeated.",
)
@click.option(
    "--episodes",
    type=click.IntRange(1, 1000),
    default=5,
    show_default=True,
    help="Episodes in which units and attributes are monitored.",
)
@search_seed_option
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE.toml",
    help="File of the map; default: maps/ROBOT-dissected.toml.",
)
@click.option(
    "--quick", is_flag=True, help="Take a first look of about a minute: fewer probes, hardly any search."
)
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="FILE.rrd",
    help="File of the report for the Rerun viewer; default: the map's name with .rrd.",
)
@click.option(
    "--figures", type=click.Path(path_type=Path), metavar="FOLDER", help="Also draw figures as PNG files."
)
@overwrite_option
@click.option(
    "--start-from",
    metavar="MAP",
    help="Also begin the searches from the behaviors of this map, given by name or file.",
)
@click.option(
    "--budget",
    type=click.FloatRange(0, min_open=True),
    metavar="MINUTES",
    help="End the searches after this time with the best found so far. Every unit is screened even if that "
    "takes longer.",
)
@workers_option
@json_option
def dissect(
    robot: str | None,
    env: str | None,
    policy: str,
    import_options: ImportOptions,
    preset: str,
    preset_changes: tuple[str, ...],
    episodes: int,
    seed: int,
    output: Path | None,
    quick: bool,
    report: Path | None,
    figures: Path | None,
    overwrite: bool,
    budget: float | None,
    start_from: str | None,
    workers: int,
    as_json: bool,
) -> None:
    """Find the units of ROBOT's policy that move something, and write a map and a report.

    An interrupted dissection continues where it stopped when the same command is run again.
    """
    from pdtui.dissection.dissect_into_map import dissect_into_map
    from pdtui.dissection.dissection_config import DissectionConfig
    from pdtui.dissection.dissection_settings import QUICK_DISSECTION, DissectionSettings
    from pdtui.pictures.picture_outputs import PictureOutputs
    from pdtui.robots import check_robot, file_stem, trust_module

    if (robot is None) == (env is None):
        raise click.UsageError("expected either ROBOT or --env ID")
    name = str(robot or env)
    trust_module(name)
    check_robot(name)
    output = output or Path("maps") / f"{file_stem(name)}-dissected.toml"
    outputs = PictureOutputs(report or output.with_suffix(".rrd"), figures, overwrite)
    outputs.check()
    with progress_bar_or_none("dissecting", quiet=as_json) as advance:

        def show_progress(stage: str, done: int, total: int) -> None:
            if advance is not None:
                advance(done, total, stage)

        config = DissectionConfig(
            name,
            policy or name,
            import_options=import_options,
            preset=preset,
            preset_changes=preset_changes,
            settings=QUICK_DISSECTION if quick else DissectionSettings(),
            episodes=episodes,
            seed=seed,
            start_from=start_from,
            budget_minutes=budget,
            workers=workers,
            progress=show_progress,
        )
        result = dissect_into_map(config, output, overwrite=overwrite, draw=outputs.draw)
    show_result(result.as_dict(), as_json, result.table)
    if not as_json:
        click.echo(f"wrote {', '.join(map(str, result.pictures))}")
