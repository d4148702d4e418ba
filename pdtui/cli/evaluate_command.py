"""`pdtui evaluate`: what behaviors do, how well targets are held, what a policy does, and experiments."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_maps, complete_robots
from pdtui.cli.evaluate.paper_experiments import (
    EXPERIMENTS,
    check_experiment,
    experiment_options,
    run_experiment,
)
from pdtui.cli.evaluate.printed_behaviors import print_behaviors
from pdtui.cli.evaluate.printed_measurements import (
    print_key_releases,
    print_policy_alone,
    print_target_tracking,
)
from pdtui.cli.options.robot_option_flag import robot_option_flag
from pdtui.cli.options.shared_options import (
    FILE_PATH,
    SeedList,
    build_drive_config,
    check_judging_seeds,
    force_option,
    import_option_flags,
    integer_option,
    journal_option,
    json_option,
    map_option,
    map_policy_option,
    overwrite_option,
    start_option,
)
from pdtui.cli.options.worker_options import workers_option
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import ImportOptions


@experiment_options
@click.command()
@click.argument("robot", shell_complete=complete_robots)
@click.argument("others", nargs=-1, metavar="[MAP.toml]...", shell_complete=complete_maps)
@robot_option_flag
@map_option
@map_policy_option
@import_option_flags
@force_option
@click.option(
    "--seeds", type=SeedList(), default="100-119", show_default=True, help="A seed, or a range of seeds."
)
@click.option(
    "--target", metavar="ATTRIBUTE", help="Measure how precisely targets of this attribute are held."
)
@click.option("--policy-only", is_flag=True, help="Measure the policy alone, one episode per seed.")
@click.option(
    "--gait",
    is_flag=True,
    help="Measure the gait of the policy without interventions: contacts, clearance and slip of each foot.",
)
@click.option(
    "--let-go",
    is_flag=True,
    help="Measure whether the robot stays up after the key of each behavior is released.",
)
@start_option
@click.option(
    "--update",
    is_flag=True,
    help="Write the measured effects into the map and keep its comments. If the map comes with pdtui, write "
    "a copy into ./maps instead.",
)
@click.option("--quick", is_flag=True, help="Take a quick look: fewer seeds and random draws.")
@click.option("--without-controls", is_flag=True, help="Leave out substitutes and disturbed worlds.")
@click.option(
    "--behavior", "behaviors", metavar="NAME", multiple=True, help="Measure only this one; may be repeated."
)
@integer_option("--hold", help="Control steps for which a behavior is held, at least 10 s; default: 1000.")
@click.option(
    "--strip",
    type=FILE_PATH,
    metavar="FILE",
    help="Draw frames of the best, the median and the worst seed of each behavior as .png, .pdf or .svg.",
)
@click.option(
    "--watch",
    is_flag=True,
    help="Then show the best, the median and the worst seed of each behavior on the screen.",
)
@click.option(
    "--experiment",
    type=click.Choice(list(EXPERIMENTS)) if EXPERIMENTS else str,
    help="Run an experiment of the paper; some compare several maps.",
)
@click.option(
    "-o",
    "--output",
    "pictures",
    type=FILE_PATH,
    multiple=True,
    metavar="FILE",
    help="Draw the result of the experiment as .png, .pdf, .svg or .rrd; may be repeated.",
)
@overwrite_option
@journal_option("run", " Of the experiments, only driving takes one.")
@workers_option
@json_option
def evaluate_command(
    robot: str,
    others: tuple[str, ...],
    robot_options: tuple[str, ...],
    map_name: str | None,
    policy: str,
    import_options: ImportOptions,
    force: bool,
    seeds: range,
    target: str | None,
    policy_only: bool,
    gait: bool,
    let_go: bool,
    start: str,
    update: bool,
    quick: bool,
    without_controls: bool,
    behaviors: tuple[str, ...],
    hold: int | None,
    strip: Path | None,
    watch: bool,
    experiment: str | None,
    pictures: tuple[Path, ...],
    overwrite: bool,
    journal: Path | None,
    workers: Workers,
    as_json: bool,
    **own_options: Any,
) -> None:
    """Measure what each behavior of ROBOT, a robot's name or a map file, does beside the policy alone."""
    own_options |= {"journal": journal} if experiment else {}
    own_options = {name: value for name, value in own_options.items() if value not in (None, ())}
    _check_modes(
        {
            "--policy-only": policy_only,
            "--gait": gait,
            "--let-go": let_go,
            "--target": target,
            "--experiment": experiment,
        },
        {
            "--update": update,
            "--quick": quick,
            "--without-controls": without_controls,
            "--behavior": behaviors,
            "--strip": strip,
            "--watch": watch,
        }
        | ({} if let_go else {"--hold": hold})
        | ({} if let_go or experiment else {"--journal": journal}),
    )
    _check_cluster(
        workers, {"--policy-only": policy_only, "--gait": gait, "--record": own_options.get("record")}
    )
    if experiment is None and (others or pictures):
        raise click.UsageError(f"{'more than one map' if others else '-o'} needs --experiment")
    without_map = policy_only or gait
    if start and not without_map:
        raise click.UsageError(
            "--start needs --policy-only or --gait; tasks and experiments define their own starts"
        )
    if update and force:
        raise MapError("--update cannot be used with --force: the map would get another policy's figures")
    if update and robot_options:
        raise MapError(
            "--update cannot be used with --robot-option: the map would get another world's figures"
        )
    if others and (map_name or policy or robot_options):
        raise click.UsageError(
            "--map, --policy and --robot-option work with one map only; compared maps name what they need"
        )
    check_experiment(experiment, others, pictures, own_options)
    config = build_drive_config(
        robot,
        map_name,
        policy,
        import_options,
        force=force,
        start=start,
        without_map=without_map,
        robot_options=robot_options,
    )
    if not without_map:
        check_judging_seeds(config, seeds)
    if experiment is not None:
        rest = [build_drive_config(other, None, "", import_options, force=force) for other in others]
        for one in rest:
            check_judging_seeds(one, seeds)
        run_experiment(
            experiment,
            as_json,
            configs=(config, *rest),
            seeds=seeds,
            workers=workers,
            pictures=pictures,
            overwrite=overwrite,
            options=own_options,
        )
    elif target is not None:
        print_target_tracking(config, target, seeds, workers, as_json)
    elif without_map:
        print_policy_alone(config, seeds, as_json, gait=gait)
    elif let_go:
        print_key_releases(config, seeds, hold, workers, journal, as_json)
    else:
        from pdtui.evaluation.evaluation_plan import select_behaviors
        from pdtui.evaluation.protocol_settings import QUICK_SEEDS, choose_protocol

        settings = choose_protocol(quick=quick, hold=hold, controls=not without_controls)
        config, drawn = select_behaviors(config, behaviors), (strip, overwrite) if strip else None
        seeds = seeds[:QUICK_SEEDS] if quick else seeds
        print_behaviors(
            config,
            seeds,
            settings,
            workers,
            drawn,
            journal=journal,
            watch=watch,
            update=update,
            as_json=as_json,
        )


def _check_cluster(workers: Workers, on_one_machine: Mapping[str, Any]) -> None:
    given = [flag for flag, on in on_one_machine.items() if on]
    if given and not isinstance(workers, int):
        raise click.UsageError(f"{given[0]} and --cluster are mutually exclusive")


def _check_modes(modes: Mapping[str, Any], behaviors_only: Mapping[str, Any]) -> None:
    chosen, given = ([flag for flag, on in flags.items() if on] for flags in (modes, behaviors_only))
    if len(chosen) > 1 or (chosen and given):
        raise click.UsageError(f"{' and '.join((chosen + given)[:2])} are mutually exclusive")
