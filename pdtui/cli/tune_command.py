"""`pdtui tune`: the gains of PID behaviors."""

from __future__ import annotations

from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_behaviors, complete_maps
from pdtui.cli.options.robot_option_flag import robot_option_flag
from pdtui.cli.options.shared_options import (
    SeedList,
    build_drive_config,
    force_option,
    import_option_flags,
    integer_option,
    json_option,
    map_policy_option,
    minutes_option,
)
from pdtui.cli.options.worker_options import workers_option
from pdtui.cli.output.command_output import describe_map_copy, print_result
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.errors import MapError
from pdtui.core.printable_text import make_printable
from pdtui.policies.weights.import_options import ImportOptions


@click.command()
@click.argument("map_name", metavar="MAP", shell_complete=complete_maps)
@click.argument("behaviors", nargs=-1, metavar="[BEHAVIOR]...", shell_complete=complete_behaviors)
@click.option("--all", "every", is_flag=True, help="Tune every behavior of mode pid.")
@robot_option_flag
@map_policy_option
@import_option_flags
@force_option
@click.option(
    "--seeds",
    type=SeedList(),
    default="2000-2019",
    show_default=True,
    help="Range of seeds; the first half is for the search, the second for choosing between what it "
    "found, the best proportional controller and the map's gains.",
)
@integer_option("--points", default=24, help="Number of gains to try first, spread over their range.")
@integer_option("--refinements", least=0, default=24, help="Number of gains to try near the best ones.")
@minutes_option("--minutes")
@click.option("--dry-run", is_flag=True, help="Tune, but do not change the map.")
@workers_option
@json_option
def tune_command(
    map_name: str,
    behaviors: tuple[str, ...],
    every: bool,
    robot_options: tuple[str, ...],
    policy: str,
    import_options: ImportOptions,
    force: bool,
    seeds: range,
    dry_run: bool,
    workers: Workers,
    as_json: bool,
    **settings: Any,
) -> None:
    """Tune the PID gains of BEHAVIORs by their step responses, and write them into MAP.

    On seeds that no search saw, what it found is compared with the map's gains and with the best
    proportional controller, which is searched in the same way. The best of the three is written. The map's
    comments are kept. Of a map that comes with pdtui, a copy is written into ./maps.
    """
    if bool(behaviors) == every:
        raise click.UsageError("expected either a BEHAVIOR or --all")
    if robot_options and not dry_run:
        raise MapError("--robot-option needs --dry-run: the map would get gains tuned for another world")
    if force and not dry_run:
        raise MapError("--force needs --dry-run: the map would get gains tuned for another policy")
    from pdtui.evaluation.evaluation_tables import tuning_table
    from pdtui.search.gains.gain_search import TuningSettings
    from pdtui.search.gains.gain_tuning import tune_gains
    from pdtui.stimulation.map_library import find_map, user_map_path
    from pdtui.stimulation.map_writer import add_seeds, replace_gains, rewrite_map

    path = find_map(map_name)
    output = path if dry_run else user_map_path(path)
    config = build_drive_config(
        str(path), None, policy, import_options, force=force, robot_options=robot_options
    )
    with progress_bar("tuning", quiet=as_json) as advance:
        results = tune_gains(
            config, behaviors, seeds, settings=TuningSettings(**settings), workers=workers, progress=advance
        )
    better = {one.behavior: one.gains for one in results if one.better}
    written = sorted(better) if not dry_run else []
    if written:
        source = str(path)

        def change(text: str) -> str:
            return add_seeds(replace_gains(text, better, source), [seeds], source)

        rewrite_map(path, change, output)
    rows = [one.as_dict() for one in results]
    data = {"map": str(output if written else path), "behaviors": rows, "written": written}
    print_result(data, as_json, lambda: tuning_table(results))
    if not as_json:
        told = f"wrote the gains of {', '.join(written)}{describe_map_copy(path, output)}"
        click.echo(make_printable(f"{output}: {told}" if written else f"{path}: not changed"))
