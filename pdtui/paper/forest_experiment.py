"""`pdtui evaluate --experiment forest`: how far a robot gets through trees that it cannot sense."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from pdtui.paper.experiment import Experiment, ExperimentReport, ExperimentRequest


def run_forest_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Measure the conditions asked for; only sessions are scored where just those are given.

    Raises:
        PdtuiError: as `evaluate_forest`.
    """
    from pdtui.paper.forest.forest_conditions import CONDITIONS, evaluate_forest
    from pdtui.paper.forest.forest_results import forest_table

    options = dict(request.options)
    options.setdefault("conditions", () if "sessions" in options else tuple(CONDITIONS))
    result = evaluate_forest(
        request.configs[0], request.seeds, workers=request.workers, progress=request.progress, **options
    )
    return ExperimentReport(asdict(result), forest_table(result))


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
            type=click.Choice(["alone", "operator", "placebo", "vision"]),
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
