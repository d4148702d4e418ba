"""The tables of what holds targets: one behavior, several side by side, and what tuning changed."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group
from rich.table import Table

from pdtui.core.text_tables import mean_with_interval, new_table, seed_range
from pdtui.search.gain_tuning import TunedGains
from pdtui.search.step_response import StepResponseSummary
from pdtui.search.tracking_summary import TrackingSummary


def tracking_table(result: TrackingSummary) -> Table:
    """One row a target, and the mean."""
    unit = result.unit
    table = new_table(
        f"{result.behavior}: {result.attribute} ({unit}), {seed_range(result.seeds)}, falls {result.falls}",
        *(f"target ({unit})", "mean |error|", "last 25 steps"),
    )
    for row in result.targets:
        table.add_row(f"{row.target:+.2f}", f"{row.error:.3f}", f"{row.settled:.3f}")
    table.add_section()
    table.add_row("mean", _with_interval(result), f"{result.settled:.3f}")
    if result.default_error is not None:
        table.add_row("without control", f"{result.default_error:.3f}", "")
    answers = result.responses
    table.caption = (
        f"rise time {_rise(answers)} s, {answers.unrisen} of {answers.steps} steps not risen; "
        f"overshoot {_overshoot(answers)}"
    )
    return table


def tuned_table(results: list[TunedGains]) -> Group:
    """Gains and figures before and after, behavior by behavior."""
    return Group(*(part for result in results for part in (_tuned(result), result.verdict)))


def _tuned(result: TunedGains) -> Table:
    before = result.before
    title = f"{result.behavior}: {before.attribute}, {seed_range(before.seeds)}"
    table = new_table(title, "", "the map's", "the best found")
    for name in ("kp", "ki", "kd", "limit"):
        table.add_row(name, *(f"{getattr(pid, name):.3g}" for pid in (result.old, result.new)))
    table.add_section()
    add_tracking_figures(table, [before, result.after])
    return table


def add_tracking_figures(table: Table, columns: Sequence[TrackingSummary]) -> None:
    unit, answers = columns[0].unit, [one.responses for one in columns]
    table.add_row(f"mean |error| ({unit})", *(_with_interval(one) for one in columns))
    table.add_row("over the last 25 steps", *(f"{one.settled:.3f}" for one in columns))
    table.add_row("rise time (s)", *map(_rise, answers))
    table.add_row("steps not risen", *(f"{one.unrisen} of {one.steps}" for one in answers))
    table.add_row("overshoot", *map(_overshoot, answers))
    table.add_row("falls", *(f"{one.falls} of {len(one.seeds)}" for one in columns))


def _with_interval(figures: TrackingSummary) -> str:
    return mean_with_interval(figures.error, figures.low, figures.high, ".3f")


def _rise(answers: StepResponseSummary) -> str:
    return "–" if answers.rise is None else f"{answers.rise:.2f}"


def _overshoot(answers: StepResponseSummary) -> str:
    return "–" if answers.overshoot is None else f"{answers.overshoot:.0%}"
