"""Commands that measure: what behaviors do, what units do, how fast the loop is."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from pdtui.cli.common import (
    Seeds,
    choice_options,
    cores,
    force_option,
    json_option,
    map_option,
    order_of_drive,
    policy_options,
    progress_bar_or_none,
    show_result,
    workers_option,
)
from pdtui.cli.experiments import EXPERIMENTS, Asked
from pdtui.errors import MapError
from pdtui.policies.choices import PolicyChoices, Spaces
from pdtui.sessions.schema import ACTIVATIONS_KEPT, ActivationsKept


@click.command()
@click.argument("robot")
@click.argument("others", nargs=-1, metavar="[MAP.toml]...")
@map_option
@policy_options
@force_option
@click.option("--seeds", type=Seeds(), default="100-119", show_default=True)
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
@click.option(
    "--target", metavar="ATTRIBUTE", help="Measure how precisely a target of this attribute is held."
)
@click.option(
    "--policy-only", is_flag=True, help="Measure the policy without any behavior: 1000 steps a seed."
)
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
    choices: PolicyChoices,
    force: bool,
    seeds: range,
    experiment: str | None,
    outputs: tuple[Path, ...],
    overwrite: bool,
    target: str | None,
    policy_only: bool,
    update: bool,
    workers: int | None,
    as_json: bool,
) -> None:
    """Measure what every behavior of ROBOT's map does, against the default.

    ROBOT may be the file of a map.
    """
    from pdtui.experiments import evaluate as behaviors
    from pdtui.experiments import steering_tables, tables, tracking, walking
    from pdtui.stimulation.remeasured import update_map

    if update and (policy_only or target is not None):
        raise MapError(
            "--update writes what was measured of behaviors; --target and --policy-only measure none"
        )
    if experiment is None and (others or outputs):
        raise click.UsageError(f"{'more than one map' if others else '-o'} needs --experiment")
    if experiment is not None and (policy_only or target is not None or update):
        raise click.UsageError("--experiment goes with neither --target, --policy-only nor --update")
    if others and (map_name or policy):
        raise click.UsageError("maps that are compared name their policies: --map and --policy are for one")
    order = order_of_drive(robot, map_name, policy, choices, force=force)
    if experiment is not None:
        rest = [order_of_drive(other, None, "", choices, force=force) for other in others]
        EXPERIMENTS[experiment](Asked((order, *rest), seeds, workers, as_json, outputs, overwrite))
    elif target is not None:
        with progress_bar_or_none("holding targets", quiet=as_json) as advance:
            tracked = tracking.evaluate_tracking(
                order, target, seeds, workers=cores(workers), progress=advance
            )
        show_result(asdict(tracked), as_json, lambda: steering_tables.tracking_table(tracked))
    elif policy_only:
        with progress_bar_or_none("walking", quiet=as_json) as advance:
            walked = walking.evaluate_walking(order, seeds, progress=advance)
        show_result(asdict(walked), as_json, lambda: tables.walking_table(walked))
    else:
        with progress_bar_or_none("evaluating", quiet=as_json) as advance:
            result = behaviors.evaluate_map(order, seeds, workers=cores(workers), progress=advance)
        if update:
            update_map(Path(order.stimulation_map.source), result.measured())
        show_result(result.as_dict(), as_json, lambda: tables.behavior_table(result))


@click.command()
@click.argument("robot", required=False)
@click.option(
    "--env",
    metavar="ID",
    help="Instead of ROBOT: an environment registered with Gymnasium, such as Hopper-v5. With a module in "
    "front (package.module:Thing-v0), that is imported first.",
)
@click.option("--policy", default="", help="Weights to dissect; default: the robot's shipped policy.")
@choice_options
@click.option("--preset", type=click.Choice(["paper", "authors"]), default="paper", show_default=True)
@click.option(
    "--set",
    "settings",
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
    choices: PolicyChoices,
    preset: str,
    settings: tuple[str, ...],
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
    """Find the units that steer ROBOT: match, then probe, then write a map and a report.

    Interrupted, the same line goes on where it was.
    """
    from pdtui.dissection.command import dissect_to_map
    from pdtui.dissection.effort import QUICK
    from pdtui.pictures.wanted import Wanted
    from pdtui.robots import check_robot, file_stem, trust_module

    if (robot is None) == (env is None):
        raise click.UsageError("expected either ROBOT or --env ID")
    name = str(robot or env)
    trust_module(name)
    check_robot(name)
    output = output or Path("maps") / f"{file_stem(name)}-dissected.toml"
    wanted = Wanted(report or output.with_suffix(".rrd"), figures, overwrite)
    wanted.check()
    with progress_bar_or_none("dissecting", quiet=as_json) as advance:
        result = dissect_to_map(
            name,
            policy or name,
            output,
            choices=choices,
            overwrite=overwrite,
            preset=preset,
            settings=settings,
            episodes=episodes,
            seed=seed,
            workers=cores(workers),
            budget_minutes=budget,
            start_from=start_from,
            effort=QUICK if quick else None,
            progress=advance,
        )
    written = [str(path) for path in wanted.draw(result.dissection)]
    show_result({**result.as_dict(), "pictures": written}, as_json, result.table)
    if not as_json:
        click.echo(f"wrote {', '.join(written)}")


@click.command()
@click.argument("robot")
@click.argument("task")
@click.option("--policy", default="", help="Weights; default: the robot's shipped policy.")
@choice_options
@click.option("--seed", type=click.IntRange(1000, 2**31 - 1), default=1000, show_default=True)
@click.option(
    "--minutes",
    type=click.FloatRange(0, min_open=True),
    default=10.0,
    show_default=True,
    help="The search ends, with the best so far, when these are over; every unit is tried all the same.",
)
@click.option("--quick", is_flag=True, help="A first look: few units, and hardly a search.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="The map that gets the behavior, new or of the same policy; default: maps/ROBOT-dissected.toml.",
)
@workers_option
@json_option
def pursue(
    robot: str,
    task: str,
    policy: str,
    choices: PolicyChoices,
    seed: int,
    minutes: float,
    quick: bool,
    output: Path | None,
    workers: int | None,
    as_json: bool,
) -> None:
    """Search for units that do a TASK of ROBOT, such as 'walker hop', and write the behavior into a map."""
    from pdtui.dissection.pursue import QUICK_PURSUIT, PursuitSizes
    from pdtui.dissection.pursuit_command import pursue_into_map
    from pdtui.robots import file_stem

    with progress_bar_or_none("pursuing", quiet=as_json) as advance:
        found = pursue_into_map(
            robot,
            task,
            policy or robot,
            output or Path("maps") / f"{file_stem(robot)}-dissected.toml",
            choices=choices,
            seed=seed,
            workers=cores(workers),
            minutes=minutes,
            sizes=QUICK_PURSUIT if quick else PursuitSizes(),
            progress=advance,
        )
    show_result(found.as_dict(), as_json, found.text)


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="The safetensors file.")
@click.option("--robot", help="The robot that it drives; it gives bounds of actions that FILE may lack.")
@choice_options
def convert(file: Path, output: Path, robot: str | None, choices: PolicyChoices) -> None:
    """Write somebody else's policy FILE as safetensors that state everything."""
    from pdtui.policies.load import convert_policy
    from pdtui.robots import make_robot, trust_module

    trust_module(robot or "")
    spaces = None if robot is None else Spaces.of_world(make_robot(robot))
    spec = convert_policy(file, output, choices, spaces)
    layers = " ".join(str(width) for width in spec.layers)
    click.echo(
        f"wrote {output}: {spec.observations} observations, hidden {layers} {spec.activation}, "
        f"{spec.actions} actions, head {spec.head}; {spec.command}"
    )


@click.command()
@click.argument("robot")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True)
@click.option("--steps", type=click.IntRange(1), default=None, help="Control steps over all worlds.")
@click.option("--algorithm", type=click.Choice(["ppo", "sac"]), default="ppo", show_default=True)
@click.option("--learning-rate", type=click.FloatRange(0, min_open=True), default=None, help="At the start.")
@click.option(
    "--forward",
    type=click.Choice(["either", "x"]),
    help="What the Ant is paid for; default: x, as in stock Ant.",
)
@click.option("--folder", type=click.Path(path_type=Path), help="Checkpoints; default: runs/ROBOT-seed.")
def train(
    robot: str,
    algorithm: str,
    seed: int,
    steps: int | None,
    learning_rate: float | None,
    forward: str | None,
    folder: Path | None,
) -> None:
    """Train a policy for ROBOT; the same line again goes on where a killed run stopped."""
    from pdtui.training.command import train_policy

    with progress_bar_or_none("training") as advance:
        path = train_policy(
            robot,
            algorithm,
            seed,
            steps,
            learning_rate,
            forward,
            folder or Path("runs") / "-".join(filter(None, (robot, algorithm, forward, str(seed)))),
            advance,
        )
    click.echo(f"best weights: {path}")


@click.group()
def bench() -> None:
    """Measure speed: ratios of one run, side by side."""


@bench.command("loop")
@click.argument("robot")
@map_option
@click.option(
    "--steps", type=click.IntRange(100), default=5000, show_default=True, help="Control steps a round."
)
@json_option
def bench_loop_command(robot: str, map_name: str | None, steps: int, as_json: bool) -> None:
    """Control steps a second of ROBOT: bare, with policy, stimulated, recorded."""
    from pdtui.experiments import bench as benchmark
    from pdtui.experiments import tables

    order = order_of_drive(robot, map_name, "")
    with progress_bar_or_none("measuring", quiet=as_json) as advance:
        result = benchmark.bench_loop(order, steps=steps, progress=advance)
    show_result(asdict(result), as_json, lambda: tables.bench_table(result))


@bench.command("dissect")
@click.argument("robot", default="ant")
@click.option("--policy", default="", help="Weights to record; default: the robot's shipped policy.")
@click.option("--episodes", type=click.IntRange(1, 100), default=5, show_default=True)
@click.option("--steps", type=click.IntRange(64), default=1000, show_default=True)
@click.option("--units", type=click.IntRange(1), default=512, show_default=True)
@click.option("--attributes", type=click.IntRange(1), default=20, show_default=True)
@click.option("--rounds", type=click.IntRange(1), default=7, show_default=True)
@click.option("--memory-units", type=click.IntRange(1), default=100_000, show_default=True)
@click.option("--probes", type=click.IntRange(2), default=240, show_default=True, help="A round.")
@json_option
def bench_dissect_command(robot: str, policy: str, as_json: bool, **sizes: Any) -> None:
    """Matching against a loop over librosa.stft, its growth and memory, and probing on two workers."""
    from pdtui.experiments import bench_dissect, tables

    with progress_bar_or_none("measuring", quiet=as_json) as advance:
        result = bench_dissect.bench_dissect(robot, policy or robot, bench_dissect.Sizes(**sizes), advance)
    show_result(asdict(result), as_json, lambda: tables.dissect_table(result))


@bench.command("record")
@click.argument("robot")
@map_option
@click.option("--steps", type=click.IntRange(100), default=6000, show_default=True)
@json_option
def bench_record_command(robot: str, map_name: str | None, steps: int, as_json: bool) -> None:
    """What recording ROBOT costs at 50 Hz: share of one core, and MB a minute."""
    from pdtui.experiments import bench_record, tables

    order = order_of_drive(robot, map_name, "")
    with progress_bar_or_none("measuring", quiet=as_json) as advance:
        result = bench_record.bench_record(order, steps=steps, progress=advance)
    show_result(asdict(result), as_json, lambda: tables.record_table(result))


@bench.command("memory")
@click.argument("robot")
@map_option
@click.option(
    "--steps",
    type=click.IntRange(100),
    default=180_000,
    show_default=True,
    help="An hour has 180,000 at 50 Hz.",
)
@click.option("--record-activations", "activations", type=click.Choice(ACTIVATIONS_KEPT), default="all")
@json_option
def bench_memory_command(
    robot: str, map_name: str | None, steps: int, activations: ActivationsKept, as_json: bool
) -> None:
    """Memory while a long drive of ROBOT is recorded and replayed."""
    from pdtui.experiments import bench_record, tables

    order = order_of_drive(robot, map_name, "", activations=activations)
    with progress_bar_or_none("driving", quiet=as_json) as advance:
        result = bench_record.bench_memory(order, steps=steps, progress=advance)
    show_result(asdict(result), as_json, lambda: tables.memory_table(result))


@bench.command("screen")
@click.argument("robot")
@map_option
@click.option("--seconds", type=click.FloatRange(1.0), default=15.0, show_default=True)
@json_option
def bench_screen_command(robot: str, map_name: str | None, seconds: float, as_json: bool) -> None:
    """Time to the first frame of a drive of ROBOT, and the CPU time of the screen, at 160×48."""
    from pdtui.experiments import bench_screen, tables

    order_of_drive(robot, map_name, "")
    arguments = [robot, "--no-record", *(["--map", map_name] if map_name else [])]
    result = bench_screen.bench_screen(arguments, seconds)
    show_result(asdict(result), as_json, lambda: tables.screen_table(result))
