"""`pdtui evaluate`: what behaviors do, how well targets are held, what a policy does, and experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.shared_options import (
    FILE_PATH,
    SeedList,
    build_drive_config,
    check_judging_seeds,
    force_option,
    import_option_flags,
    integer_option,
    json_option,
    map_option,
    map_policy_option,
    overwrite_option,
    print_result,
    progress_bar,
    start_option,
    workers_option,
)
from pdtui.core.errors import MapError
from pdtui.policies.weights.import_options import ImportOptions

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.evaluation.protocol_settings import ProtocolSettings
    from pdtui.paper.experiment import Experiment


def find_experiments() -> dict[str, Experiment]:
    """Return the paper's experiments by name; none where `pdtui.paper` is not installed."""
    try:
        from pdtui.paper.experiment import list_experiments
    except ModuleNotFoundError as error:
        if error.name == "pdtui.paper":
            return {}
        raise
    return list_experiments()


EXPERIMENTS = find_experiments()


def experiment_options(command: click.Command) -> click.Command:
    """Add the options of the experiments to a command."""
    for name, experiment in EXPERIMENTS.items():
        for option in experiment.options:
            option.help = f"With --experiment {name}: {option.help}"
            command.params.append(option)
    return command


@experiment_options
@click.command()
@click.argument("robot")
@click.argument("others", nargs=-1, metavar="[MAP.toml]...")
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
@start_option
@click.option(
    "--update", is_flag=True, help="Write the effects of the behaviors into the map; its comments are kept."
)
@click.option("--quick", is_flag=True, help="Take a quick look: fewer seeds and random draws.")
@integer_option("--hold", help="Control steps for which a behavior is held, at least 10 s; default: 1000.")
@click.option(
    "--strip",
    type=FILE_PATH,
    metavar="FILE.png",
    help="Draw frames of the best, the median and the worst seed of each behavior.",
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
    metavar="FILE.png|.rrd",
    help="Draw the result of the experiment; may be repeated.",
)
@overwrite_option
@workers_option
@json_option
def evaluate_command(
    robot: str,
    others: tuple[str, ...],
    map_name: str | None,
    policy: str,
    import_options: ImportOptions,
    force: bool,
    seeds: range,
    target: str | None,
    policy_only: bool,
    start: str,
    update: bool,
    quick: bool,
    hold: int | None,
    strip: Path | None,
    experiment: str | None,
    pictures: tuple[Path, ...],
    overwrite: bool,
    workers: int,
    as_json: bool,
    **own_options: Any,
) -> None:
    """Measure what each behavior of ROBOT, a robot's name or a map file, does beside the policy alone."""
    own_options = {name: value for name, value in own_options.items() if value not in (None, ())}
    _check_modes(
        {"--policy-only": policy_only, "--target": target, "--experiment": experiment},
        {"--update": update, "--quick": quick, "--hold": hold, "--strip": strip},
    )
    if experiment is None and (others or pictures):
        raise click.UsageError(f"{'more than one map' if others else '-o'} needs --experiment")
    if start and not policy_only:
        raise click.UsageError("--start needs --policy-only; tasks and experiments have their own starts")
    if update and force:
        raise MapError("--update cannot be used with --force: the map would get another policy's figures")
    if others and (map_name or policy):
        raise click.UsageError("--map and --policy work with one map only; compared maps name their policies")
    if experiment is None and own_options:
        raise click.UsageError(f"{_flag(own_options)} needs --experiment")
    if experiment is not None:
        _check_experiment(EXPERIMENTS.get(experiment), others, pictures, own_options)
    config = build_drive_config(robot, map_name, policy, import_options, force=force, start=start)
    if not policy_only:
        check_judging_seeds(config, seeds)
    if experiment is not None:
        rest = [build_drive_config(other, None, "", import_options, force=force) for other in others]
        _run_experiment(
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
        from pdtui.evaluation.evaluation_tables import tracking_table
        from pdtui.evaluation.target_tracking import evaluate_target_tracking

        with progress_bar("holding targets", quiet=as_json) as advance:
            tracking = evaluate_target_tracking(config, target, seeds, workers=workers, progress=advance)
        print_result(asdict(tracking), as_json, lambda: tracking_table(tracking))
    elif policy_only:
        from pdtui.evaluation.evaluation_tables import policy_evaluation_table
        from pdtui.evaluation.policy_evaluation import evaluate_policy

        with progress_bar("evaluating", quiet=as_json) as advance:
            alone = evaluate_policy(config, seeds, progress=advance)
        print_result(asdict(alone), as_json, lambda: policy_evaluation_table(alone))
    else:
        from pdtui.evaluation.protocol_settings import QUICK_SEEDS, choose_protocol

        settings, drawn = choose_protocol(quick=quick, hold=hold), (strip, overwrite) if strip else None
        seeds = seeds[:QUICK_SEEDS] if quick else seeds
        _evaluate_behaviors(config, seeds, settings, workers, drawn, update=update, as_json=as_json)


def _evaluate_behaviors(
    config: DriveConfig,
    seeds: range,
    settings: ProtocolSettings,
    workers: int,
    drawn: tuple[Path, bool] | None,
    *,
    update: bool,
    as_json: bool,
) -> None:
    from pdtui.evaluation import behavior_evaluation as evaluation
    from pdtui.evaluation.behavior_tables import behavior_tables
    from pdtui.pictures.behavior_strips import draw_strips, film_strips
    from pdtui.pictures.matplotlib_page import check_figure_path
    from pdtui.stimulation.map_writer import replace_effects, rewrite_map

    if drawn is not None:
        check_figure_path(*drawn)
    plan = evaluation.plan_evaluation(config, seeds, settings)
    if not as_json:
        click.echo(f"{evaluation.count_control_steps(plan):,} control steps, {workers} processes", err=True)
    with progress_bar("evaluating", quiet=as_json) as advance:
        result = evaluation.evaluate_behaviors(config, plan, workers=workers, progress=advance)
    if update:
        path = Path(config.stimulation_map.source)
        rewrite_map(path, lambda text: replace_effects(text, result.measured_effects(), str(path)))
    print_result(asdict(result), as_json, lambda: behavior_tables(result))
    if drawn is not None:
        with progress_bar("filming", quiet=as_json) as advance:
            draw_strips(drawn[0], plan, result, film_strips(plan, result, advance))


def _check_modes(modes: Mapping[str, Any], behaviors_only: Mapping[str, Any]) -> None:
    chosen, given = ([flag for flag, on in flags.items() if on] for flags in (modes, behaviors_only))
    if len(chosen) > 1 or (chosen and given):
        raise click.UsageError(f"{' and '.join((chosen + given)[:2])} are mutually exclusive")


def _check_experiment(
    experiment: Experiment | None, others: Sequence[str], pictures: Sequence[Path], options: Mapping[str, Any]
) -> None:
    """Refuse what the experiment would otherwise silently ignore."""
    if experiment is None:
        return  # `pdtui.paper` is not installed, which running it will say
    name, own = experiment.name, [option.name for option in experiment.options]
    if foreign := {option: value for option, value in options.items() if option not in own}:
        raise click.UsageError(f"--experiment {name} has no option {_flag(foreign)}")
    if others and not experiment.takes_several_maps:
        raise click.UsageError(f"--experiment {name} takes one map")
    if pictures and not experiment.draws_pictures:
        raise click.UsageError(f"--experiment {name} draws no pictures; leave -o out")


def _flag(options: Mapping[str, Any]) -> str:
    """The first of these options as it is typed."""
    name = next(iter(options))
    return next(one.opts[0] for e in EXPERIMENTS.values() for one in e.options if one.name == name)


def _run_experiment(name: str, as_json: bool, **request: Any) -> None:
    from pdtui.paper.experiment import ExperimentRequest

    experiment = EXPERIMENTS[name]
    with progress_bar(experiment.progress_label, quiet=as_json) as advance:
        report = experiment.run(ExperimentRequest(**request, progress=advance))
    print_result(report.data, as_json, lambda: report.table)
    if report.pictures and not as_json:
        click.echo(f"wrote {', '.join(map(str, report.pictures))}")
