"""Commands that make: maps from policies, and policies."""

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
from pdtui.policies.weights.import_options import ImportOptions, WorldSpaces


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
    import_options: ImportOptions,
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
    from pdtui.dissection.dissect_to_map import dissect_to_map
    from pdtui.dissection.dissection_settings import QUICK_DISSECTION
    from pdtui.pictures.picture_outputs import PictureOutputs
    from pdtui.robots import check_robot, file_stem, trust_module

    if (robot is None) == (env is None):
        raise click.UsageError("expected either ROBOT or --env ID")
    name = str(robot or env)
    trust_module(name)
    check_robot(name)
    output = output or Path("maps") / f"{file_stem(name)}-dissected.toml"
    wanted = PictureOutputs(report or output.with_suffix(".rrd"), figures, overwrite)
    wanted.check()
    with progress_bar_or_none("dissecting", quiet=as_json) as advance:
        result = dissect_to_map(
            name,
            policy or name,
            output,
            import_options=import_options,
            overwrite=overwrite,
            preset=preset,
            settings=settings,
            episodes=episodes,
            seed=seed,
            workers=core_count(workers),
            budget_minutes=budget,
            start_from=start_from,
            effort=QUICK_DISSECTION if quick else None,
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
@import_option_flags
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
    import_options: ImportOptions,
    seed: int,
    minutes: float,
    quick: bool,
    output: Path | None,
    workers: int | None,
    as_json: bool,
) -> None:
    """Search for units that do a TASK of ROBOT, such as 'walker hop', and write the behavior into a map."""
    from pdtui.dissection.task_search_to_map import search_task_into_map
    from pdtui.robots import file_stem
    from pdtui.search.task_search import QUICK_TASK_SEARCH, TaskSearchSettings

    with progress_bar_or_none("pursuing", quiet=as_json) as advance:
        found = search_task_into_map(
            robot,
            task,
            policy or robot,
            output or Path("maps") / f"{file_stem(robot)}-dissected.toml",
            import_options=import_options,
            seed=seed,
            workers=core_count(workers),
            minutes=minutes,
            settings=QUICK_TASK_SEARCH if quick else TaskSearchSettings(),
            progress=advance,
        )
    show_result(found.as_dict(), as_json, found.text)


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="The safetensors file.")
@click.option("--robot", help="The robot that it drives; it gives bounds of actions that FILE may lack.")
@import_option_flags
def convert(file: Path, output: Path, robot: str | None, import_options: ImportOptions) -> None:
    """Write somebody else's policy FILE as safetensors that state everything."""
    from pdtui.policies.weights.policy_loading import convert_policy
    from pdtui.robots import make_robot, trust_module

    trust_module(robot or "")
    spaces = None if robot is None else WorldSpaces.of_world(make_robot(robot))
    spec = convert_policy(file, output, import_options, spaces)
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
    from pdtui.training.train_policy import train_policy

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
