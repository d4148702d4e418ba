"""`pdtui dissect`: from a policy to a map and a report."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.shared_options import (
    core_count,
    import_option_flags,
    json_option,
    progress_bar_or_none,
    show_result,
    workers_option,
)
from pdtui.policies.weights.import_options import ImportOptions


@click.command()
@click.argument("robot", required=False)
@click.option(
    "--env",
    metavar="ID",
    help="Instead of ROBOT: an environment registered with Gymnasium, such as Hopper-v5. With a module in "
    "front (package.module:Thing-v0), that is imported first.",
)
@click.option("--policy", default="", help="Weights to dissect; default: the robot's shipped policy.")
@import_option_flags
@click.option("--preset", type=click.Choice(["paper", "authors"]), default="paper", show_default=True)
@click.option(
    "--set",
    "preset_changes",
    multiple=True,
    metavar="NAME=VALUE",
    help="Change a choice of the preset, such as window=hann or length=32; a wrong name lists all.",
)
@click.option("--episodes", type=click.IntRange(1, 1000), default=5, show_default=True)
@click.option("--seed", type=click.IntRange(1000, 2**31 - 1), default=1000, show_default=True)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The map; default: maps/ROBOT-dissected.toml."
)
@click.option(
    "--quick", is_flag=True, help="A first look, for about a minute: fewer probes, and hardly a search."
)
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="FILE.rrd",
    help="The report for the Rerun viewer; default: beside the map, under its name.",
)
@click.option(
    "--figures", type=click.Path(path_type=Path), metavar="FOLDER", help="Draw figures as PNGs, too."
)
@click.option("--overwrite", is_flag=True, help="Replace map, report and figures that exist already.")
@click.option(
    "--start-from", metavar="MAP", help="Searches begin from this map's behaviors, too: a name or a file."
)
@click.option(
    "--budget",
    type=click.FloatRange(0, min_open=True),
    metavar="MINUTES",
    help="Searches end, with the best so far, when this is over; every unit is screened all the same.",
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
    workers: int | None,
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
            workers=core_count(workers),
            progress=show_progress,
        )
        result = dissect_into_map(config, output, overwrite=overwrite, draw=outputs.draw)
    show_result(result.as_dict(), as_json, result.table)
    if not as_json:
        click.echo(f"wrote {', '.join(map(str, result.pictures))}")
