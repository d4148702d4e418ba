"""The tables of the paper's experiments."""

from __future__ import annotations

import math
from pathlib import Path

from rich.console import Group
from rich.table import Table

from pdtui.core.text_tables import new_table, seed_range
from pdtui.evaluation.tracking_tables import add_tracking_figures
from pdtui.paper.command_following import CommandFollowing
from pdtui.paper.forest_results import ForestResult, RepeatSpread
from pdtui.paper.unit_vs_command import HeadingController, UnitCommandComparison
from pdtui.search.tracking_drives import STEPS_EACH


def commands_table(result: CommandFollowing) -> Table:
    """How closely each command is followed."""
    table = new_table(
        f"{result.robot}, policy {result.policy}, {seed_range(result.seeds)}, {result.steps} steps each",
        *("command", "asked", "mean |error| [95 %]", "without the gait", "falls"),
    )
    count = len(result.seeds)
    for row in result.commands:
        table.add_row(
            f"{row.command} ({row.unit})",
            f"{min(row.asked):+.2f} to {max(row.asked):+.2f}",
            f"{row.error:.3f} [{row.low:.3f}, {row.high:.3f}]",
            f"{row.bias:.3f}",
            f"{count - result.finished}/{count}",
        )
    return table


def forest_table(result: ForestResult) -> Group:
    """One column a condition, figures per episode; then what was left out."""
    measured = f", {seed_range(result.seeds)} in {result.repeats} repeats" if result.seeds else ""
    rows = result.conditions
    table = new_table(
        f"{result.robot} in the forest, {result.steps} steps ({result.seconds:g} s) at most{measured}",
        *("per episode", *(row.condition for row in rows)),
    )
    table.add_row("policy", *(row.policy for row in rows))
    table.add_row("reward", *(_spread(row.reward, 0) for row in rows))
    table.add_row("distance along x (m)", *(_spread(row.distance, 2) for row in rows))
    table.add_row("collisions", *(_spread(row.collisions, 2) for row in rows))
    table.add_row("keys", *(_spread(row.presses, 1) for row in rows))
    table.add_row("steps with a key", *(_spread(row.involvement, 1) for row in rows))
    table.add_row("falls", *(f"{row.falls}/{row.episodes}" for row in rows))
    table.add_row("crossed the forest", *(f"{row.crossed}/{row.episodes}" for row in rows))
    said = ["mean ± standard deviation of the repeats; an episode ends at a fall or the forest's far end"]
    if result.sessions:
        said.append("a person's sessions: the first episode of each is a repeat")
    said += [f"left out: {name}: {why}" for name, why in result.left_out.items()]
    return Group(table, *said)


def _spread(figure: RepeatSpread, digits: int) -> str:
    spread = "" if math.isnan(figure.std) else f" ± {figure.std:.{digits}f}"
    return f"{figure.mean:.{digits}f}{spread}"


def precision_table(result: UnitCommandComparison) -> Table:
    """One column a behavior, map by map."""
    table = new_table(
        f"holding headings: {seed_range(result.seeds)}", "", *(row.tracking.behavior for row in result.rows)
    )
    table.add_row("map", *(Path(row.map).name for row in result.rows))
    table.add_row("policy", *(row.policy for row in result.rows))
    table.add_row("PID on", *(_driven(row) for row in result.rows))
    table.add_row("asked besides", *(_asked(row) for row in result.rows))
    table.add_section()
    add_tracking_figures(table, [row.tracking for row in result.rows])
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


def _driven(row: HeadingController) -> str:
    names = row.driven if len(row.driven) <= 2 else (row.driven[0], f"{len(row.driven) - 1} more")
    return {"command": "command ", "units": "unit ", "both": ""}[row.by] + ", ".join(names)


def _asked(row: HeadingController) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in row.asked.items())
