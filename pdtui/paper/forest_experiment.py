"""`pdtui evaluate --experiment forest`: how far a robot gets through trees that it cannot sense."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pdtui.paper.experiment import Experiment, ExperimentReport, ExperimentRequest

if TYPE_CHECKING:
    from rich.console import Group

    from pdtui.paper.forest.forest_results import ForestExperimentResult, RepeatStatistics


def run_forest_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Measure the conditions asked for; only sessions are scored where just those are given.

    Raises:
        PdtuiError: as `evaluate_forest`.
    """
    from pdtui.paper.forest.forest_conditions import CONDITIONS, evaluate_forest

    options = dict(request.options)
    options.setdefault("conditions", () if "sessions" in options else tuple(CONDITIONS))
    result = evaluate_forest(
        request.configs[0], request.seeds, workers=request.workers, progress=request.progress, **options
    )
    return ExperimentReport(asdict(result), forest_table(result))


def forest_table(result: ForestExperimentResult) -> Group:
    """Return a table with one column per condition and figures per episode, and notes below it."""
    from rich.console import Group

    from pdtui.core.text_tables import new_table, seed_range

    measured = f", {seed_range(result.seeds)} in {result.repeats} repeats" if result.seeds else ""
    rows = result.conditions
    table = new_table(
        f"{result.robot} in the forest, at most {result.steps} steps ({result.seconds:g} s){measured}",
        *("per episode", *(row.condition for row in rows)),
    )
    table.add_row("policy", *(row.policy for row in rows))
    table.add_row("reward", *(_mean_and_spread(row.reward, 0) for row in rows))
    table.add_row("distance along x (m)", *(_mean_and_spread(row.distance, 2) for row in rows))
    table.add_row("collisions", *(_mean_and_spread(row.collisions, 2) for row in rows))
    table.add_row("key presses", *(_mean_and_spread(row.presses, 1) for row in rows))
    table.add_row("steps with a key press", *(_mean_and_spread(row.involvement, 1) for row in rows))
    table.add_row("falls", *(f"{row.falls}/{row.episodes}" for row in rows))
    table.add_row("crossed the forest", *(f"{row.crossed}/{row.episodes}" for row in rows))
    notes = ["Mean ± standard deviation over repeats. An episode ends at a fall or at the far end."]
    if result.sessions:
        notes.append("The first episode of each scored session counts as a repeat.")
    notes += [f"Not measured: {condition}: {reason}" for condition, reason in result.left_out.items()]
    return Group(table, *notes)


def _mean_and_spread(figure: RepeatStatistics, digits: int) -> str:
    spread = "" if math.isnan(figure.std) else f" ± {figure.std:.{digits}f}"
    return f"{figure.mean:.{digits}f}{spread}"


EXPERIMENT = Experiment(
    "forest",
    "crossing the forest",
    run_forest_experiment,
    (
        click.Option(
            ["--steps"],
            type=click.IntRange(1),
            metavar="N",
            help="Longest episode, in control steps.  [default: 2400]",
        ),
        click.Option(
            ["--repeats"],
            type=click.IntRange(1),
            metavar="N",
            help="Number of groups of seeds.  [default: 5]",
        ),
        click.Option(
            ["--condition", "conditions"],
            multiple=True,
            type=click.Choice(["alone", "operator", "vision"]),
            help="Measure only this condition; may be repeated.  [default: all]",
        ),
        click.Option(
            ["--session", "sessions"],
            multiple=True,
            type=click.Path(path_type=Path),
            help="Score a recorded drive; may be repeated. Conditions are then measured only where "
            "--condition names them.",
        ),
        click.Option(
            ["--record"],
            type=click.Path(path_type=Path, file_okay=False),
            metavar="FOLDER",
            help="Record the operator's drives, each as a session and a keystroke file.",
        ),
    ),
)
