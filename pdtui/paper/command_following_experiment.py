"""`pdtui evaluate --experiment commands`: how closely a policy follows its commands."""

from __future__ import annotations

from dataclasses import asdict

from pdtui.paper.experiment import Experiment, ExperimentReport, ExperimentRequest


def run_command_following_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Measure the policy of each map.

    Raises:
        PdtuiError: as `evaluate_command_following`.
    """
    from rich.console import Group

    from pdtui.paper.command_following import command_following_table, evaluate_command_following

    count = len(request.configs)
    results = []
    for number, config in enumerate(request.configs):

        def tell(done: int, total: int, number: int = number) -> None:
            if request.progress is not None:
                request.progress(number * total + done, count * total)

        results.append(evaluate_command_following(config, request.seeds, progress=tell))
    data = [asdict(result) for result in results]
    return ExperimentReport(data[0] if count == 1 else data, Group(*map(command_following_table, results)))


EXPERIMENT = Experiment(
    "commands", "following commands", run_command_following_experiment, takes_several_maps=True
)
