"""The tables of `pdtui evaluate`: what is seen, how it goes on, and what else would do as well."""

from __future__ import annotations

import math

from rich.console import Group
from rich.table import Table

from pdtui.core.console.text_tables import (
    format_mean_with_interval,
    format_p_value,
    format_seed_range,
    new_table,
)
from pdtui.core.outcome import count_failures, failure_noun, format_failures
from pdtui.evaluation.behavior_evaluation import MapEvaluation
from pdtui.evaluation.behavior_summary import AS_LARGE, BehaviorEvaluation
from pdtui.evaluation.disturbance_conditions import UNDISTURBED
from pdtui.evaluation.effect_figures import WindowEffect
from pdtui.evaluation.tasks.task_tables import task_tables


def behavior_tables(result: MapEvaluation) -> Group:
    """Return all tables of an evaluation."""
    tables: list[Table | str] = []
    if result.behaviors:
        tables += [_criteria_table(result), _time_table(result)]
        if any(row.substitutes for row in result.behaviors):
            tables.append(_substitutes_table(result))
        if any(row.condition != UNDISTURBED.name for row in result.behaviors):
            tables.append(_conditions_table(result))
    if result.tasks:
        tables += task_tables(_title(result), result.tasks, result.settings)
    return Group(*tables, *_notes(result))


def _criteria_table(result: MapEvaluation) -> Table:
    rows = result.undisturbed()
    title = f"{_title(result)}, held for {rows[0].held:.0f} s"
    left = ["behavior", "is called so if it"]
    noun = failure_noun(rows[0].outcomes)
    columns = ("median", "met [95 %]", "by itself", noun, f"{noun} by itself", "back after release")
    table = new_table(title, *left, *columns, left=left)
    for row in rows:
        table.add_row(
            row.behavior,
            row.criterion,
            f"{row.seen:.2f} {row.quantity}",
            f"{row.judged}/{row.runs} [{row.judged_low:.0%}, {row.judged_high:.0%}]",
            f"{row.judged_by_itself}/{row.runs}",
            format_failures(row.outcomes, row.runs),
            format_failures(row.default_outcomes, row.runs),
            f"{row.back}/{row.runs}",
        )
    return table


def _time_table(result: MapEvaluation) -> Table:
    table = new_table(
        "Effect on the attribute, compared with the same seeds without a press",
        *("behavior", "attribute", "default", "first 5 s [95 %]", "last 5 s [95 %]", "p", "holds"),
        *("half there after", "lasts"),
    )
    for row in result.undisturbed():
        table.add_row(
            row.behavior,
            f"{row.attribute} ({row.unit})",
            f"{row.first.default:.2f}",
            _effect(row.first),
            _effect(row.last),
            format_p_value(row.last.corrected),
            "yes" if row.holds else "no",
            "–" if math.isnan(row.onset) else f"{row.onset:.1f} s",
            f"{row.lasts:.1f} s ({row.lasting}/{row.runs} to the end)",
        )
    table.caption = (
        "Intervals: studentized bootstrap over starts; a run counts as 0 from its end on. p: paired "
        "sign-flip test of the last 5 s, corrected over the rows (Holm); an effect holds if p < "
        f"{result.settings.level:g} and it goes the wanted way. Half there: half of the effect of the first "
        "5 s; lasts: until less is left for good (medians)."
    )
    return table


def _substitutes_table(result: MapEvaluation) -> Table:
    settings, noun = result.settings, failure_noun(result.behaviors[0].outcomes)
    table = new_table(
        "Would something else do as well?",
        *("behavior", f"random units: as large, met, {noun}", "random directions", "on the actions"),
        *("specificity", "largest side effect"),
    )
    for row in result.undisturbed():
        side, cells = row.side_effects, {}
        for one in row.substitutes:
            failures = format_failures(one.outcomes, one.draws * one.seeds)
            cells[one.kind] = f"{one.as_large}/{one.draws}, {one.judged}/{one.draws}, {failures}"
            if one.kind == "actions":
                met = "met" if one.judged else "not met"
                cells[one.kind] = f"{one.effect:+.2f} of {one.own_effect:+.2f}, {met}, {failures}"
        table.add_row(
            row.behavior,
            *(cells.get(kind, "–") for kind in ("random units", "random directions", "actions")),
            f"{side.wanted:+.1f} σ / {side.others:.1f} σ = {side.specificity:.1f}",
            side.largest,
        )
    table.caption = (
        f"{settings.draws} draws of as many random units of the same layers at the same |v|, and of random "
        "directions as long as the behavior's own change of its layers; on the actions, its mean change of "
        f"them. {settings.draw_seeds} seeds each. As large: at least {AS_LARGE:.0%} of the effect in the "
        "last 5 s; met: the criterion on half of the seeds. Specificity: the effect over the whole hold "
        "beside the mean of all others, in standard deviations of the default's walk."
    )
    return table


def _conditions_table(result: MapEvaluation) -> Table:
    noun = failure_noun(result.behaviors[0].outcomes)
    table = new_table(
        "Disturbed; p is corrected over the disturbed rows",
        *("behavior", "condition", "last 5 s [95 %]", "p", "holds", "met", noun, f"{noun} by itself"),
        left=["behavior", "condition"],
    )
    for name in dict.fromkeys(row.behavior for row in result.behaviors):
        table.add_section()
        for row in result.behaviors:
            if row.behavior == name:
                table.add_row(name if row.condition == UNDISTURBED.name else "", *_condition_cells(row))
    return table


def _condition_cells(row: BehaviorEvaluation) -> list[str]:
    return [
        row.condition,
        _effect(row.last),
        format_p_value(row.last.corrected),
        "yes" if row.holds else "no",
        f"{row.judged}/{row.runs}",
        format_failures(row.outcomes, row.runs),
        format_failures(row.default_outcomes, row.runs),
    ]


def _notes(result: MapEvaluation) -> list[str]:
    notes = []
    rows = result.undisturbed()
    if rows and all(2 * count_failures(row.default_outcomes) >= row.runs for row in rows):
        failures = format_failures(rows[0].default_outcomes, rows[0].runs)
        noun = failure_noun(rows[0].default_outcomes)
        notes.append(
            f"Without a press, there are {failures} {noun} by itself: the policy is weak, and {noun} with a "
            "behavior tell little about the behavior."
        )
    if result.nearly_one_start:
        notes.append(
            f"These {len(result.seeds)} seeds are nearly one start: without a press, they differ by "
            f"{result.start_spread:.1%} of the mean. Intervals tell about this start; see the spread starts."
        )
    if result.not_offered:
        notes.append(f"Not offered by {result.robot}: {', '.join(result.not_offered)}.")
    return notes


def _title(result: MapEvaluation) -> str:
    return f"{result.robot}, policy {result.policy}, {format_seed_range(result.seeds)}"


def _effect(window: WindowEffect) -> str:
    return format_mean_with_interval(window.effect, window.low, window.high, "+.2f")
