"""`pdtui evaluate`: what behaviors do, how well targets are held, what a policy does, and experiments."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from pdtui.cli.experiment_commands import EXPERIMENTS, ExperimentRequest
from pdtui.cli.forest_options import forest_options
from pdtui.cli.shared_options import (
    SeedList,
    core_count,
    drive_config,
    force_option,
    json_option,
    map_option,
    policy_options,
    progress_bar_or_none,
    show_result,
    start_option,
    workers_option,
)
from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import ImportOptions


@click.command()
@click.argument("robot")
@click.argument("others", nargs=-1, metavar="[MAP.toml]...")
@map_option
@policy_options
@force_option
@click.option("--seeds", type=SeedList(), default="100-119", show_default=True)
@click.option(
    "--experiment",
    type=click.Choice(list(EXPERIMENTS)),
    help="One of the paper's experiments; it may compare several maps.",
)
@click.option(
    "-o",
    "--output",
    "outputs",
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE.png|.rrd",
    help="Draw the experiment; may be given again.",
)
@click.option("--overwrite", is_flag=True, help="Replace a picture that exists already.")
@forest_options
@click.option(
    "--target", metavar="ATTRIBUTE", help="Measure how precisely a target of this attribute is held."
)
@click.option(
    "--policy-only", is_flag=True, help="Measure the policy without any behavior, an episode a seed."
)
@start_option
@click.option(
    "--update",
    is_flag=True,
    help="Write what was measured of the behaviors into the map; its comments stay.",
)
@workers_option
@json_option
def evaluate(
    robot: str,
    others: tuple[str, ...],
    map_name: str | None,
    policy: str,
    import_options: ImportOptions,
    force: bool,
    seeds: range,
    experiment: str | None,
    outputs: tuple[Path, ...],
    overwrite: bool,
    forest: dict[str, Any],
    target: str | None,
    policy_only: bool,
    start: str,
    update: bool,
    workers: int | None,
    as_json: bool,
) -> None:
    """Measure what every behavior of ROBOT's map does, against the default.

    ROBOT may be the file of a map.
    """
    from pdtui.evaluation import behavior_evaluation as behaviors
    from pdtui.evaluation import evaluation_tables, policy_evaluation, target_tracking, tracking_tables
    from pdtui.stimulation.map_writer import write_effects

    if update and (policy_only or target is not None):
        raise MapError(
            "--update writes what was measured of behaviors; --target and --policy-only measure none"
        )
    if experiment is None and (others or outputs):
        raise click.UsageError(f"{'more than one map' if others else '-o'} needs --experiment")
    if experiment is not None and (policy_only or target is not None or update):
        raise click.UsageError("--experiment goes with neither --target, --policy-only nor --update")
    if forest and experiment != "forest":
        raise click.UsageError(f"--{next(iter(forest)).removesuffix('s')} needs --experiment forest")
    if start and not policy_only:
        raise click.UsageError("--start needs --policy-only; tasks and experiments choose theirs")
    if others and (map_name or policy):
        raise click.UsageError("maps that are compared name their policies: --map and --policy are for one")
    config = drive_config(robot, map_name, policy, import_options, force=force, start=start)
    if experiment is not None:
        rest = [drive_config(other, None, "", import_options, force=force) for other in others]
        asked = ExperimentRequest((config, *rest), seeds, workers, as_json, outputs, overwrite, forest)
        EXPERIMENTS[experiment](asked)
    elif target is not None:
        with progress_bar_or_none("holding targets", quiet=as_json) as advance:
            tracked = target_tracking.evaluate_tracking(
                config, target, seeds, workers=core_count(workers), progress=advance
            )
        show_result(asdict(tracked), as_json, lambda: tracking_tables.tracking_table(tracked))
    elif policy_only:
        with progress_bar_or_none("walking", quiet=as_json) as advance:
            walked = policy_evaluation.evaluate_policy(config, seeds, progress=advance)
        show_result(asdict(walked), as_json, lambda: evaluation_tables.walking_table(walked))
    else:
        with progress_bar_or_none("evaluating", quiet=as_json) as advance:
            result = behaviors.evaluate_map(config, seeds, workers=core_count(workers), progress=advance)
        if update:
            write_effects(Path(config.stimulation_map.source), result.measured())
        show_result(result.as_dict(), as_json, lambda: evaluation_tables.behavior_table(result))
