"""The tables of tasks: their success, what would do as well, and both in disturbed worlds."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from pdtui.core.console.text_tables import format_p_value, new_table
from pdtui.core.outcome import describe_outcomes, failure_noun, format_failures
from pdtui.evaluation.disturbance_conditions import UNDISTURBED
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.evaluation.tasks.task_success import TaskEvaluation


def task_tables(title: str, rows: Sequence[TaskEvaluation], settings: ProtocolSettings) -> list[Table]:
    """Return the tables of tasks; those of substitutes and conditions only if there are any."""
    undisturbed = [row for row in rows if row.condition == UNDISTURBED.name]
    tables = [_success_table(title, undisturbed)]
    if any(row.substitutes for row in undisturbed):
        tables.append(_substitutes_table(undisturbed, settings))
    if len(undisturbed) < len(rows):
        tables.append(_conditions_table(rows))
    return tables


def _success_table(title: str, rows: Sequence[TaskEvaluation]) -> Table:
    left = ["behavior", "success means"]
    table = new_table(
        f"{title}: tasks",
        *left,
        *(
            "success [95 %]",
            "without it",
            "p",
            "holds",
            "after a long hold",
            f"{failure_noun(rows[0].outcomes)} (without)",
            "measured (without it)",
        ),
        left=left,
    )
    for row in rows:
        nothing = float("nan")
        measured = ", ".join(
            f"{name} {value:.2f} ({row.figures_by_itself.get(name, nothing):.2f})"
            for name, value in row.figures.items()
        )
        table.add_row(
            f"{row.behavior}, after {row.after}" if row.after else row.behavior,
            row.wanted,
            f"{row.done}/{row.runs} [{row.low:.0%}, {row.high:.0%}]",
            *_comparison(row),
            "–" if row.still_done is None else f"{row.still_done}/{row.runs}",
            _failures(row),
            measured,
        )
    table.caption = (
        "p: paired sign-flip test (McNemar's), corrected over the rows (Holm). After a long hold: the judge "
        "sees the last part of it."
    )
    return table


def _substitutes_table(rows: Sequence[TaskEvaluation], settings: ProtocolSettings) -> Table:
    kinds, noun = ("random units", "random directions", "actions"), failure_noun(rows[0].outcomes)
    table = new_table(
        "Tasks: would something else do as well?",
        *("behavior", f"random units: as good, success, {noun}", "random directions", "on the actions"),
    )
    for row in (one for one in rows if not one.after):
        cells = {}
        for one in row.substitutes:
            runs = one.draws * one.seeds
            failures = format_failures(one.outcomes, runs)
            cells[one.kind] = f"{one.as_good}/{one.draws}, {one.done}/{runs}, {failures}"
        table.add_row(row.behavior, *(cells.get(kind, "–") for kind in kinds))
    table.caption = (
        f"{settings.draws} draws of as many random units of the same layers at the same |v|, and of random "
        "directions as long as the behavior's own change of its layers; on the actions, its mean change of "
        f"them. {settings.draw_seeds} seeds each. As good: succeeds on at least as many of these seeds as "
        "the behavior."
    )
    return table


def _conditions_table(rows: Sequence[TaskEvaluation]) -> Table:
    table = new_table(
        "Tasks, disturbed; p is corrected over the disturbed rows",
        *(
            "behavior",
            "condition",
            "success",
            "without",
            "p",
            "holds",
            f"{failure_noun(rows[0].outcomes)} (without)",
        ),
        left=["behavior", "condition"],
    )
    for name in dict.fromkeys(row.behavior for row in rows):
        table.add_section()
        for row in rows:
            if row.behavior == name and not row.after:
                first = name if row.condition == UNDISTURBED.name else ""
                done = f"{row.done}/{row.runs}"
                table.add_row(first, row.condition, done, *_comparison(row), _failures(row))
    return table


def _comparison(row: TaskEvaluation) -> tuple[str, str, str]:
    without, holds = f"{row.by_itself}/{row.runs}", "yes" if row.holds else "no"
    return without, format_p_value(row.corrected), holds


def _failures(row: TaskEvaluation) -> str:
    with_it, by_itself = format_failures(row.outcomes, row.runs), row.outcomes_by_itself
    words = describe_outcomes(by_itself).removeprefix("falls ")
    return f"{with_it} ({words})"
