"""`pdtui evaluate --experiment redirect`: a right angle to either side and back."""

from __future__ import annotations

from dataclasses import asdict

from pdtui.paper.experiment import Experiment, ExperimentReport, ExperimentRequest


def run_redirect_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Redirect the robot of a map.

    Raises:
        PdtuiError: as `measure_heading_redirects`.
    """
    from pdtui.paper.heading_redirect_measurement import heading_redirect_table, measure_heading_redirects

    (config,) = request.configs
    result = measure_heading_redirects(config, request.seeds, progress=request.progress)
    return ExperimentReport(asdict(result), heading_redirect_table(result))


EXPERIMENT = Experiment("redirect", "redirecting", run_redirect_experiment)
