"""The tables of what holds targets: one behavior, several side by side, and what tuning changed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Group
from rich.table import Table

from pdtui.experiments.following import STEPS_EACH
from pdtui.experiments.precision import Precision, Steering
from pdtui.experiments.response import Responses
from pdtui.experiments.tables import new_table, seeds_of
from pdtui.experiments.tracking import Tracking
from pdtui.experiments.tune import Tuned


def tracking_table(result: Tracking) -> Table:
    """One row a target, and the mean."""
    unit = result.unit
    table = new_table(
        f"{result.behavior}: {result.attribute} ({unit}), {seeds_of(result.seeds)}, falls {result.falls}",
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


def precision_table(result: Precision) -> Table:
    """One column a behavior, map by map."""
    table = new_table(
        f"holding headings: {seeds_of(result.seeds)}", "", *(row.tracking.behavior for row in result.rows)
    )
    table.add_row("map", *(Path(row.map).name for row in result.rows))
    table.add_row("policy", *(row.policy for row in result.rows))
    table.add_row("PID on", *(_driven(row) for row in result.rows))
    table.add_row("asked besides", *(_asked(row) for row in result.rows))
    table.add_section()
    _add_figures(table, [row.tracking for row in result.rows])
    ratios = [row.ratio for row in result.rows]
    if any(ratios):
        cells = ["" if one is None else f"{one.value:.2f} [{one.low:.2f}, {one.high:.2f}]" for one in ratios]
        table.add_row("|error| / the command's", *cells)
    steps = ", ".join(f"{target:g}" for target in result.targets)
    table.caption = (
        f"targets {steps} rad, {STEPS_EACH} steps each; intervals 95 %, of the ratio over pairs of the same "
        "seed; a drive counts until its end or its fall"
    )
    return table


def tuned_table(results: list[Tuned]) -> Group:
    """Gains and figures before and after, behavior by behavior."""
    return Group(*(part for result in results for part in (_tuned(result), result.verdict)))


def _tuned(result: Tuned) -> Table:
    before = result.before
    title = f"{result.behavior}: {before.attribute}, {seeds_of(before.seeds)}"
    table = new_table(title, "", "the map's", "the best found")
    for name in ("kp", "ki", "kd", "limit"):
        table.add_row(name, *(f"{getattr(pid, name):.3g}" for pid in (result.old, result.new)))
    table.add_section()
    _add_figures(table, [before, result.after])
    return table


def _add_figures(table: Table, columns: Sequence[Tracking]) -> None:
    unit, answers = columns[0].unit, [one.responses for one in columns]
    table.add_row(f"mean |error| ({unit})", *(_with_interval(one) for one in columns))
    table.add_row("over the last 25 steps", *(f"{one.settled:.3f}" for one in columns))
    table.add_row("rise time (s)", *map(_rise, answers))
    table.add_row("steps not risen", *(f"{one.unrisen} of {one.steps}" for one in answers))
    table.add_row("overshoot", *map(_overshoot, answers))
    table.add_row("falls", *(f"{one.falls} of {len(one.seeds)}" for one in columns))


def _with_interval(figures: Tracking) -> str:
    return f"{figures.error:.3f} [{figures.low:.3f}, {figures.high:.3f}]"


def _rise(answers: Responses) -> str:
    return "–" if answers.rise is None else f"{answers.rise:.2f}"


def _overshoot(answers: Responses) -> str:
    return "–" if answers.overshoot is None else f"{answers.overshoot:.0%}"


def _driven(row: Steering) -> str:
    names = row.driven if len(row.driven) <= 2 else (row.driven[0], f"{len(row.driven) - 1} more")
    return {"command": "command ", "units": "unit ", "both": ""}[row.by] + ", ".join(names)


def _asked(row: Steering) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in row.asked.items())
