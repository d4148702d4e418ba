"""`pdtui evaluate --experiment tracking`: how precisely headings are held, by units and by a command."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pdtui.core.outcome import count_failures
from pdtui.paper.experiment import Experiment, ExperimentReport, ExperimentRequest

if TYPE_CHECKING:
    from rich.table import Table

    from pdtui.paper.heading_precision import HeadingControllerResult, HeadingPrecisionComparison
    from pdtui.pictures.heading_figures import HeadingFigure


def run_tracking_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Compare the heading controllers of the maps, and draw them.

    Raises:
        PdtuiError: as `compare_heading_precision`, or a picture cannot be written.
    """
    from pdtui.paper.heading_precision import compare_heading_precision
    from pdtui.pictures.heading_figures import draw_heading_pictures
    from pdtui.pictures.picture_paths import check_picture_paths

    check_picture_paths(request.pictures, request.overwrite)
    result = compare_heading_precision(
        request.configs, request.seeds, workers=request.workers, progress=request.progress, **request.options
    )
    draw_heading_pictures(request.pictures, build_heading_figure(result))
    data = {**result.as_dict(), "pictures": [str(path) for path in request.pictures]}
    return ExperimentReport(data, heading_precision_table(result), request.pictures)


def build_heading_figure(result: HeadingPrecisionComparison) -> HeadingFigure:
    """Return what the pictures show of a comparison."""
    import numpy as np

    from pdtui.pictures.heading_figures import HeadingFigure, TrackedHeading
    from pdtui.search.gains.tracking_drives import STEPS_EACH

    several = len({row.map for row in result.rows}) > 1
    headings = []
    for row in result.rows:
        figures = row.tracking
        failed = count_failures(figures.outcomes)
        falls = f", {failed} of {len(figures.seeds)} fell" if failed else ""
        name = f"{figures.behavior} ({row.policy})" if several else figures.behavior
        headings.append(TrackedHeading(name, f"{figures.error:.3f} rad{falls}", row.headings))
    robots = ", ".join(dict.fromkeys(row.robot for row in result.rows))
    return HeadingFigure(
        f"Holding headings: {robots}",
        np.repeat(np.array(result.targets), STEPS_EACH),
        result.dt,
        tuple(headings),
        heading_precision_table(result),
        result.as_dict(),
    )


def heading_precision_table(result: HeadingPrecisionComparison) -> Table:
    """Return a table with one column per behavior, map by map."""
    from pdtui.core.console.text_tables import format_seed_range, new_table
    from pdtui.evaluation.evaluation_tables import add_tracking_figures, format_ratio
    from pdtui.search.gains.tracking_drives import STEPS_EACH

    table = new_table(
        f"Holding headings: {format_seed_range(result.seeds)}",
        "",
        *(row.tracking.behavior for row in result.rows),
    )
    table.add_row("map", *(Path(row.map).name for row in result.rows))
    table.add_row("policy", *(row.policy for row in result.rows))
    table.add_row("PID output to", *map(_inputs, result.rows))
    table.add_row("other commands", *map(_other_commands, result.rows))
    table.add_section()
    add_tracking_figures(table, [row.tracking for row in result.rows])
    ratios = [row.ratio for row in result.rows]
    if any(ratios):
        table.add_row("|error| / |error| of the command", *map(format_ratio, ratios))
    pushed = [row.pushed for row in result.rows if row.pushed is not None]
    if pushed:
        table.add_section()
        tracking = [one.tracking for one in pushed]
        table.add_row(f"pushed, {format_seed_range(tracking[0].seeds)}", *("" for _ in pushed))
        add_tracking_figures(table, tracking)
        table.add_row("|error| / |error| of the command", *(format_ratio(one.ratio) for one in pushed))
    targets = ", ".join(f"{target:g}" for target in result.targets)
    table.caption = (
        f"Targets: {targets} rad, {STEPS_EACH} steps each. Intervals: 95 %; that of the ratio pairs drives "
        "of the same seed. A drive counts until it ends or the robot falls."
    )
    return table


def _inputs(row: HeadingControllerResult) -> str:
    names = row.inputs if len(row.inputs) <= 2 else (row.inputs[0], f"{len(row.inputs) - 1} more")
    prefix = {"command": "command ", "units": "unit "}.get(row.input_kind, "")
    return prefix + ", ".join(names)


def _other_commands(row: HeadingControllerResult) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in row.other_commands.items())


EXPERIMENT = Experiment(
    "tracking",
    "holding headings",
    run_tracking_experiment,
    (
        click.Option(
            ["--pushed"],
            is_flag=True,
            default=None,
            help="Run the first 10 seeds again with pushes of up to ±0.8 m/s every 1 to 3 s.",
        ),
    ),
    takes_several_maps=True,
    draws_pictures=True,
)
