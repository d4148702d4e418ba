"""The command that chooses controllers' gains."""

from __future__ import annotations

import click

from pdtui.cli.shared_options import (
    SeedList,
    core_count,
    drive_config,
    force_option,
    json_option,
    policy_options,
    progress_bar_or_none,
    show_result,
    workers_option,
)
from pdtui.policies.weights.import_options import ImportOptions


@click.command()
@click.argument("map_name", metavar="MAP")
@click.argument("behaviors", nargs=-1, metavar="[BEHAVIOR]...")
@click.option("--all", "every", is_flag=True, help="Tune every behavior of mode pid.")
@policy_options
@force_option
@click.option(
    "--seeds",
    type=SeedList(),
    default="200-209",
    show_default=True,
    help="The search sees the first half, the others judge what it found.",
)
@click.option(
    "--points", type=click.IntRange(1), default=48, show_default=True, help="Controllers to begin with."
)
@click.option(
    "--refinements",
    type=click.IntRange(0),
    default=24,
    show_default=True,
    help="Controllers to try near the best.",
)
@click.option(
    "--minutes",
    type=click.FloatRange(0, min_open=True),
    help="The search ends, with the best so far, when these are over; by default it finishes.",
)
@click.option("--dry-run", is_flag=True, help="Leave the map as it is.")
@workers_option
@json_option
def tune(
    map_name: str,
    behaviors: tuple[str, ...],
    every: bool,
    policy: str,
    import_options: ImportOptions,
    force: bool,
    seeds: range,
    points: int,
    refinements: int,
    minutes: float | None,
    dry_run: bool,
    workers: int | None,
    as_json: bool,
) -> None:
    """Choose gains and limits of BEHAVIORs of mode pid by their step responses, and write them into MAP.

    The map's comments stay; gains that are no better on seeds that the search did not see are not written.
    """
    if bool(behaviors) == every:
        raise click.UsageError("expected either a BEHAVIOR or --all")
    from pdtui.evaluation.tracking_tables import tuned_table
    from pdtui.search.gain_tuning import TuningSettings
    from pdtui.search.gain_tuning import tune_gains as search
    from pdtui.stimulation.map_library import find_map
    from pdtui.stimulation.map_writer import replace_gains, rewrite_map

    path = find_map(map_name)
    order = drive_config(str(path), None, policy, import_options, force=force)
    with progress_bar_or_none("tuning", quiet=as_json) as advance:
        results = search(
            order,
            behaviors,
            seeds,
            settings=TuningSettings(points, refinements, minutes),
            workers=core_count(workers),
            progress=advance,
        )
    better = {one.behavior: one.new for one in results if one.better}
    if better and not dry_run:
        rewrite_map(path, lambda text: replace_gains(text, better, str(path)))
    written = sorted(better) if not dry_run else []
    data = {"map": str(path), "behaviors": [one.as_dict() for one in results], "written": written}
    show_result(data, as_json, lambda: tuned_table(results))
    if not as_json:
        click.echo(
            f"{path}: wrote the gains of {', '.join(written)}" if written else f"{path}: left as it is"
        )
