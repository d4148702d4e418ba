"""`pdtui tune`: the gains of PID behaviors."""

from __future__ import annotations

import click

from pdtui.cli.shared_options import (
    SeedList,
    drive_config,
    force_option,
    json_option,
    policy_options,
    progress_bar_or_none,
    show_result,
    workers_option,
)
from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import ImportOptions


@click.command()
@click.argument("map_name", metavar="MAP")
@click.argument("behaviors", nargs=-1, metavar="[BEHAVIOR]...")
@click.option("--all", "every", is_flag=True, help="Tune all behaviors of mode pid.")
@policy_options
@force_option
@click.option(
    "--seeds",
    type=SeedList(),
    default="200-209",
    show_default=True,
    help="Seeds; the first half is for the search, the second for judging its result.",
)
@click.option(
    "--points",
    type=click.IntRange(1),
    default=48,
    show_default=True,
    help="Gains to try first, spread over the range.",
)
@click.option(
    "--refinements",
    type=click.IntRange(0),
    default=24,
    show_default=True,
    help="Gains to try near the best.",
)
@click.option(
    "--minutes",
    type=click.FloatRange(0, min_open=True),
    metavar="MINUTES",
    help="Stop the search after this time and keep the best so far.",
)
@click.option("--dry-run", is_flag=True, help="Do not change the map.")
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
    workers: int,
    as_json: bool,
) -> None:
    """Tune the PID gains of BEHAVIORs by their step responses, and write them into MAP.

    Gains are written only if they are better on seeds that the search did not see. The map's comments are
    kept.
    """
    if bool(behaviors) == every:
        raise click.UsageError("expected either a BEHAVIOR or --all")
    if force and not dry_run:
        raise MapError("--force needs --dry-run: the map would get gains tuned for another policy")
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
            workers=workers,
            progress=advance,
        )
    better = {one.behavior: one.new for one in results if one.better}
    if better and not dry_run:
        rewrite_map(path, lambda text: replace_gains(text, better, str(path)))
    written = sorted(better) if not dry_run else []
    data = {"map": str(path), "behaviors": [one.as_dict() for one in results], "written": written}
    show_result(data, as_json, lambda: tuned_table(results))
    if not as_json:
        click.echo(f"{path}: wrote the gains of {', '.join(written)}" if written else f"{path}: not changed")
