"""Tables that tell what a dissection found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich.table import Table

from pdtui.core.console.text_tables import new_table
from pdtui.core.units import describe_units
from pdtui.dissection.steering.steering_summary import steering_tables
from pdtui.probing.matching_hits import TOP_MATCHES

LISTED_MATCHES = 3
"""Units that a table lists for each attribute."""


def dissection_tables(summary: dict[str, Any]) -> list[Table]:
    """Return the tables of a summary. Every cell is text."""
    tables = [
        _matching_table(summary),
        _probing_table(summary),
        _range_table(summary),
        _agreement_table(summary),
        _mover_table(summary),
        *steering_tables(summary["steering"]),
    ]
    if summary["behaviors"]:
        tables.append(_behavior_table(summary))
    if summary["tasks"]:
        tables.append(_task_table(summary))
    if summary["holds"]:
        tables.append(_controller_table(summary))
    return tables


def _matching_table(summary: dict[str, Any]) -> Table:
    title = f"Matching ({' '.join([summary['preset'], *summary['settings_changed']])}): nearest units"
    table = new_table(title, "attribute", "Hz", "unit", "discrepancy", "level share", "ρ", "circular ρ")
    for attribute in summary["attributes"]:
        for number, one in enumerate(attribute["matches"][:LISTED_MATCHES]):
            label = attribute["name"] if number == 0 else ""
            frequency = f"{attribute['frequency']:.2f}" if number == 0 else ""
            circular = _show(one["rho_circular"], "+.2f") + (" !" if one["rho_disagree"] else "")
            table.add_row(
                label,
                frequency,
                one["unit"] + (" †" if one["flaw"] else ""),
                _show(one["discrepancy"], ".3g"),
                _show(one["level_share"], ".0%"),
                _show(one["rho"], "+.2f"),
                circular,
            )
        if not attribute["matches"]:
            table.add_row(attribute["name"], "–", "none", "–", "–", "–", "–")
    return table


def _probing_table(summary: dict[str, Any]) -> Table:
    judged = summary["judged"]
    return _table(
        f"Probing: effects of units, {judged['starts']} starts, beside {judged['controls']} random units",
        [(attribute, one) for attribute in summary["attributes"] for one in attribute["probed"] or [None]],
        {
            "attribute": lambda pair: f"{pair[0]['name']} ({pair[0]['unit']})",
            "unit": lambda pair: _probed_unit(pair[1]),
            "effect [95 %]": lambda pair: _effect(pair[1]),
            "p: flips / random units": lambda pair: _p_values(pair[1]),
            "corrected": lambda pair: "" if pair[1] is None else _show(pair[1]["corrected_p"], ".2g"),
            "held long": lambda pair: "" if pair[1] is None else _effect(pair[1]["held"]),
            "both ways": lambda pair: "" if pair[1] is None else _yes(pair[1]["both_ways"]),
        },
    )


def _range_table(summary: dict[str, Any]) -> Table:
    names = {"in_range": "in its own range", "out_of_range": "outside it"}
    return _table(
        "Pairs by whether the unit puts out such values by itself",
        [(names[key], counts) for key, counts in summary["judged"]["ranges"].items()],
        {
            "output": lambda row: row[0],
            "judged": lambda row: str(row[1]["judged"]),
            "more than chance": lambda row: str(row[1]["confirmed"]),
            "at the end of its own range": lambda row: str(row[1]["at_end_of_range"]),
        },
    )


def _agreement_table(summary: dict[str, Any]) -> Table:
    hits = "hits: first / " + " / ".join(f"best {count}" for count in TOP_MATCHES) + " / random"
    return _table(
        "Matching against probing",
        summary["attributes"],
        {
            "attribute": lambda one: one["name"],
            "first match": lambda one: _probed_unit(one["first_match"]),
            hits: lambda one: " / ".join(
                [
                    _yes(one["hits"]["first"]),
                    *(_show(one["hits"][f"best_{count}"], ".0%") for count in TOP_MATCHES),
                    _show(one["hits"]["random"], ".0%"),
                ]
            ),
            "held-out rank correlation: matching": lambda one: _show(
                one["hits"]["held_out_matching"], "+.2f"
            ),
            "without noise": lambda one: _show(one["hits"]["disattenuated_matching"], "+.2f"),
            "screening": lambda one: _show(one["hits"]["held_out_probing"], "+.2f"),
            "noise ceiling": lambda one: _show(one["hits"]["ceiling"], ".2f"),
        },
    )


def _mover_table(summary: dict[str, Any]) -> Table:
    def side_effect(one: dict[str, Any]) -> str:
        alone = "" if one["side_alone"] is None else f" (with one unit: {_show(one['side_alone'], '.2f')})"
        return _show(one["side"], ".2f") + alone

    return _table(
        "Up and down, on held-out starts",
        summary["steered"],
        {
            "attribute": lambda one: f"{one['attribute']} {one['direction']}",
            "units": lambda one: describe_units(one["units"]),
            "effect [95 %]": _effect,
            "falls": lambda one: f"{one['falls']} of {one['of']}",
            "effect / SD": lambda one: _show(one["main"], ".2f"),
            "largest side effect / SD": side_effect,
        },
    )


def _behavior_table(summary: dict[str, Any]) -> Table:
    return _table(
        "Behaviors, on held-out starts",
        summary["behaviors"],
        {
            "behavior": lambda one: one["name"] + _why_not_reached(one),
            "units": lambda one: describe_units(one["units"]),
            "gain [95 %]": lambda one: _effect(one, "gain", ".2f"),
            "goal": lambda one: f"{one['enough']:g}",
            "best random set: gain (p)": lambda one: (
                f"{_show(one['rival']['gain'], '.2f')} ({_show(one['rival']['p'], '.2g')})"
            ),
            "success": lambda one: f"{one['success']:.0%}",
            "falls": lambda one: f"{one['falls']:.0%}",
            "attribute: without → with": lambda one: (
                f"{one['attribute']}: {_show(one['unperturbed'], '.2f')} → {_show(one['value'], '.2f')}"
            ),
        },
    )


def _task_table(summary: dict[str, Any]) -> Table:
    return _table(
        "Tasks, on held-out walks",
        summary["tasks"],
        {
            "task": lambda one: one["name"],
            "units": lambda one: describe_units(one["units"]),
            "seconds": lambda one: "" if one["period"] is None else f"{one['period']:g}",
            "done": lambda one: f"{one['done']} of {one['walks']}",
            "without": lambda one: f"{one['by_itself']} of {one['walks']}",
            "means": lambda one: ", ".join(f"{name} {value:.2f}" for name, value in one["figures"].items()),
        },
    )


def _controller_table(summary: dict[str, Any]) -> Table:
    return _table(
        "Controllers, on held-out starts",
        summary["holds"],
        {
            "attribute": lambda one: (
                one["attribute"] + ("" if one["holds"] else " (does not hold the target)")
            ),
            "units": lambda one: describe_units(one["units"]),
            "kp / ki / limit": lambda one: f"{one['kp']:.3g} / {one['ki']:.3g} / {one['limit']:g}",
            "error": lambda one: (
                f"{_show(one['error'], '.2f')} (uncontrolled: {_show(one['uncontrolled'], '.2f')})"
            ),
            "falls": lambda one: f"{one['falls']:.0%}",
        },
    )


def _table(title: str, rows: Sequence[Any], cells: Mapping[str, Callable[[Any], str]]) -> Table:
    """Return a table with a column for each heading in `cells`, whose function makes a row's cell."""
    table = new_table(title, *cells)
    for row in rows:
        table.add_row(*(cell(row) for cell in cells.values()))
    return table


def _probed_unit(one: dict[str, Any] | None) -> str:
    if one is None:
        return "none"
    outside = "" if one["in_range"] else " ‡"
    return f"{one['unit']} = {one['value']:g}{outside}" + ("" if one["confirmed"] else " (not confirmed)")


def _why_not_reached(behavior: dict[str, Any]) -> str:
    if behavior["reached"]:
        return ""
    return " (random units do as well)" if behavior["reliable"] else " (goal not reached)"


def _p_values(one: dict[str, Any] | None) -> str:
    return "" if one is None else f"{_show(one['flip_p'], '.2g')} / {_show(one['random_p'], '.2g')}"


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _effect(one: dict[str, Any] | None, name: str = "effect", form: str = "+.2f") -> str:
    if one is None:
        return ""
    return f"{_show(one[name], form)} [{_show(one['low'], form)}, {_show(one['high'], form)}]"


def _show(number: float | None, form: str) -> str:
    return "–" if number is None else format(number, form)
