"""`pdtui evaluate --experiment commands`: how closely a policy follows its commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pdtui.paper.experiment import Experiment, ExperimentReport, ExperimentRequest

if TYPE_CHECKING:
    from rich.table import Table

    from pdtui.paper.command_following import CommandFollowingResult


def run_commands_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Measure the policy of each map.

    Raises:
        PdtuiError: as `evaluate_command_following`.
    """
    from rich.console import Group

    from pdtui.paper.command_following import evaluate_command_following

    count = len(request.configs)
    results = []
    for number, config in enumerate(request.configs):

        def tell(done: int, total: int, number: int = number) -> None:
            if request.progress is not None:
                request.progress(number * total + done, count * total)

        results.append(evaluate_command_following(config, request.seeds, progress=tell))
    documents = [result.as_dict() for result in results]
    return ExperimentReport(
        documents[0] if len(documents) == 1 else documents, Group(*map(commands_table, results))
    )


def commands_table(result: CommandFollowingResult) -> Table:
    """Return a table with one row per command."""
    from pdtui.core.text_tables import mean_with_interval, new_table, seed_range

    table = new_table(
        f"{result.robot}, policy {result.policy}, {seed_range(result.seeds)}, {result.steps} steps each",
        *("command", "asked", "mean |error| [95 %]", "without the gait", "falls"),
    )
    count = len(result.seeds)
    for row in result.commands:
        table.add_row(
            f"{row.command} ({row.unit})",
            f"{min(row.asked):+.2f} to {max(row.asked):+.2f}",
            mean_with_interval(row.error, row.low, row.high, ".3f"),
            f"{row.bias:.3f}",
            f"{count - result.finished}/{count}",
        )
    return table


EXPERIMENT = Experiment("commands", "following commands", run_commands_experiment, takes_several_maps=True)
