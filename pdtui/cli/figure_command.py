"""`pdtui figure`: figures as PNG files."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.shared_options import import_option_flags, overwrite_option, progress_bar_or_none
from pdtui.core.printable_text import make_printable
from pdtui.policies.weights.import_options import ImportOptions


@click.group()
def figure() -> None:
    """Draw figures as PNG files."""


@figure.command("episode")
@click.argument("robot")
@click.option("--policy", default="", metavar="FILE", help="Weights; default: the robot's shipped policy.")
@import_option_flags
@click.option(
    "--attribute", "attributes", multiple=True, metavar="NAME", help="Attribute to draw; may be repeated."
)
@click.option(
    "--unit",
    "units",
    multiple=True,
    metavar="LAYER:INDEX",
    help="Unit to draw with it, one per --attribute; default: its best match.",
)
@click.option(
    "--preset",
    type=click.Choice(["paper", "authors"]),
    default="paper",
    show_default=True,
    help="Settings of the matching.",
)
@click.option(
    "--seed", type=click.IntRange(0, 2**31 - 1), default=1000, show_default=True, help="Seed of the episode."
)
@click.option(
    "--from", "start", type=click.FloatRange(0), default=0.0, metavar="SECONDS", help="Where to start."
)
@click.option(
    "--seconds",
    type=click.FloatRange(0, min_open=True),
    default=10.0,
    show_default=True,
    metavar="SECONDS",
    help="How much to draw.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    required=True,
    metavar="FILE.png",
    help="File to write.",
)
@overwrite_option
def episode(
    robot: str,
    policy: str,
    import_options: ImportOptions,
    attributes: tuple[str, ...],
    units: tuple[str, ...],
    preset: str,
    seed: int,
    start: float,
    seconds: float,
    output: Path,
    overwrite: bool,
) -> None:
    """Draw attributes and their matching units over one episode.

    As in figure 2 of the paper. ROBOT is a robot's name or the ID of a Gymnasium environment.
    """
    from pdtui.pictures.matplotlib_page import check_figure
    from pdtui.robots import check_robot, trust_module

    trust_module(robot)
    check_robot(robot)
    check_figure(output, overwrite)
    from pdtui.pictures.matched_curves import draw_matched_curves, match_episode

    with progress_bar_or_none("rolling out") as advance:
        curves = match_episode(
            robot,
            policy or robot,
            attributes=attributes,
            units=units,
            import_options=import_options,
            preset=preset,
            seed=seed,
            progress=advance,
        )
    draw_matched_curves(output, curves, start=start, seconds=seconds)
    for pair in curves.pairs:
        click.echo(
            f"{make_printable(pair.attribute.name)}: unit {pair.unit}, discrepancy {pair.discrepancy:.3g}"
        )
    click.echo(f"wrote {output}")
