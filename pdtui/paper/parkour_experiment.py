"""`pdtui evaluate --experiment parkour`: how a robot crosses courses of obstacles that it does not sense."""

from __future__ import annotations

from dataclasses import asdict

from pdtui.paper.experiment import (
    CONDITION_OPTION,
    RECORD_OPTION,
    SESSION_OPTION,
    STEPS_OPTION,
    Experiment,
    ExperimentReport,
    ExperimentRequest,
)


def run_parkour_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Measure the conditions asked for; only sessions are scored where just those are given.

    Raises:
        PdtuiError: as `evaluate_parkour`.
    """
    from pdtui.paper.parkour.course_conditions import CONDITIONS, evaluate_parkour
    from pdtui.paper.parkour.course_results import parkour_table

    options = dict(request.options)
    options.setdefault("conditions", () if "sessions" in options else tuple(CONDITIONS))
    result = evaluate_parkour(
        request.configs[0], request.seeds, workers=request.workers, progress=request.progress, **options
    )
    return ExperimentReport(asdict(result), parkour_table(result))


EXPERIMENT = Experiment(
    "parkour",
    "crossing courses",
    run_parkour_experiment,
    (STEPS_OPTION, CONDITION_OPTION, SESSION_OPTION, RECORD_OPTION),
)
