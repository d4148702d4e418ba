"""`pdtui evaluate --experiment forest`: how far a robot gets through trees that it cannot sense."""

from __future__ import annotations

from dataclasses import asdict

from pdtui.paper.experiment import (
    CONDITION_OPTION,
    RECORD_OPTION,
    REPEATS_OPTION,
    SESSION_OPTION,
    STEPS_OPTION,
    Experiment,
    ExperimentReport,
    ExperimentRequest,
)


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
    (STEPS_OPTION, REPEATS_OPTION, CONDITION_OPTION, SESSION_OPTION, RECORD_OPTION),
)
