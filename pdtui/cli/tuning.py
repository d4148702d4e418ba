"""The command that chooses controllers' gains."""

from __future__ import annotations

import click

from pdtui.cli.common import (
    Seeds,
    cores,
    force_option,
    json_option,
    order_of_drive,
    policy_options,
    progress_bar_or_none,
    show_result,
    workers_option,
)
from pdtui.policies.choices import PolicyChoices


@click.command()
@click.argument("map_name", metavar="MAP")
@click.argument("behaviors", nargs=-1, metavar="[BEHAVIOR]...")
@click.option("--all", "every", is_flag=True, help="Tune every behavior of mode pid.")
@policy_options
@force_option
@click.option(
    "--seeds",
    type=Seeds(),
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
    choices: PolicyChoices,
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
    from pdtui.experiments.steering_tables import tuned_table
    from pdtui.experiments.tune import Effort
    from pdtui.experiments.tune import tune as search
    from pdtui.stimulation.library import find_map
    from pdtui.stimulation.remeasured import change_map, with_gains

    path = find_map(map_name)
    order = order_of_drive(str(path), None, policy, choices, force=force)
    with progress_bar_or_none("tuning", quiet=as_json) as advance:
        results = search(
            order,
            behaviors,
            seeds,
            effort=Effort(points, refinements, minutes),
            workers=cores(workers),
            progress=advance,
        )
    better = {one.behavior: one.new for one in results if one.better}
    if better and not dry_run:
        change_map(path, lambda text: with_gains(text, better, str(path)))
    written = sorted(better) if not dry_run else []
    data = {"map": str(path), "behaviors": [one.as_dict() for one in results], "written": written}
    show_result(data, as_json, lambda: tuned_table(results))
    if not as_json:
        click.echo(
            f"{path}: wrote the gains of {', '.join(written)}" if written else f"{path}: left as it is"
        )
