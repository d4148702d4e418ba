"""The tables of `pdtui evaluate`."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table

from pdtui.core.text_tables import mean_with_interval, new_table, seed_range
from pdtui.evaluation.behavior_evaluation import MapEvaluation
from pdtui.evaluation.policy_evaluation import PolicyEvaluation


def behavior_tables(result: MapEvaluation) -> Group:
    """Return a table of the behaviors that move an attribute, and one of those with a task."""
    tables = [_aim_table(result)] if result.behaviors else []
    return Group(*tables, *([_task_table(result)] if result.tasks else []))


def _task_table(result: MapEvaluation) -> Table:
    table = new_table(
        f"{result.robot}, policy {result.policy}, {seed_range(result.seeds)}",
        *("behavior", "success means", "success", "without it", "falls", "measured (without it)"),
    )
    count = len(result.seeds)
    for row in result.tasks:
        measured = ", ".join(
            f"{name} {value:.2f} ({row.figures_by_itself.get(name, float('nan')):.2f})"
            for name, value in row.figures.items()
        )
        table.add_row(
            row.behavior,
            row.wanted,
            f"{row.done}/{count}",
            f"{row.by_itself}/{count}",
            f"{row.falls}/{count}",
            measured,
        )
    return table


def _aim_table(result: MapEvaluation) -> Table:
    table = new_table(
        f"{result.robot}, policy {result.policy}, {seed_range(result.seeds)}",
        *("behavior", "attribute", "with it", "default", "effect [95 %]", "aim reached", "falls"),
    )
    count = len(result.seeds)
    for row in result.behaviors:
        table.add_row(
            row.behavior,
            row.measure,
            f"{row.value:.2f}",
            f"{row.default:.2f}",
            mean_with_interval(row.effect, row.low, row.high, "+.2f"),
            f"{row.right_sign}/{count}",
            f"{row.falls}/{count}",
        )
    return table


def policy_table(result: PolicyEvaluation) -> Table:
    """Return the performance of the policy alone."""
    table = new_table(
        f"Policy alone, {seed_range(result.seeds)}, {result.steps} steps each", "measure", "value"
    )
    for name, speed in (("mean speed (m/s)", result.mean_speed), ("net speed (m/s)", result.net_speed)):
        if speed is not None:
            table.add_row(name, f"{speed:.2f}")
    table.add_row("return", f"{result.mean_return:.0f} ± {result.std_return:.0f}")
    table.add_row("episodes without a fall", f"{result.finished}/{len(result.seeds)}")
    return table
