"""Tables and remarks that tell what a dissection found."""

from __future__ import annotations

from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from pdtui.core.text_tables import new_table
from pdtui.core.units import MAX_LISTED, describe_units
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarise_dissection
from pdtui.probing.confirmation import TOP_MATCHES

_MATCHES = 3


def render_dissection(dissection: Dissection) -> RenderableType:
    """Return what `pdtui dissect` prints: the tables, then the remarks."""
    summary = summarise_dissection(dissection)
    return Group(*dissection_tables(summary), *(Text(line) for line in dissection_remarks(summary)))


def dissection_tables(summary: dict[str, Any]) -> list[Table]:
    """Return the tables of a summary. Every cell is text."""
    tables = [_matching_table(summary), _probing_table(summary), _mover_table(summary)]
    if summary["behaviors"]:
        tables.append(_behavior_table(summary))
    if summary["holds"]:
        tables.append(_controller_table(summary))
    return tables


def _matching_table(summary: dict[str, Any]) -> Table:
    title = f"Matching ({' '.join([summary['preset'], *summary['settings_changed']])}): nearest units"
    table = new_table(title, "attribute", "Hz", "unit", "discrepancy", "level share", "ρ", "circular ρ")
    for attribute in summary["attributes"]:
        for number, one in enumerate(attribute["matches"][:_MATCHES]):
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
    table = new_table(
        "Probing: measured effects of units",
        "attribute",
        "best unit",
        "effect [95 %]",
        "both ways",
        "first match",
        "its effect [95 %]",
        "hits: first / " + " / ".join(f"best {count}" for count in TOP_MATCHES) + " / random",
        "held-out rank correlation: matching / probing",
    )
    for attribute in summary["attributes"]:
        best = attribute["probed"][0] if attribute["probed"] else None
        first, hits = attribute["first_match"], attribute["hits"]
        table.add_row(
            f"{attribute['name']} ({attribute['unit']})",
            _probed_name(best),
            _effect(best),
            "" if best is None else ("yes" if best["both_ways"] else "no"),
            _probed_name(first),
            _effect(first),
            " / ".join(
                [
                    "yes" if hits["first"] else "no",
                    *(_show(hits[f"best_{count}"], ".0%") for count in TOP_MATCHES),
                    _show(hits["random"], ".0%"),
                ]
            ),
            f"{_show(hits['held_out_matching'], '+.2f')} / {_show(hits['held_out_probing'], '+.2f')}",
        )
    return table


def _mover_table(summary: dict[str, Any]) -> Table:
    table = new_table(
        "Up and down, on held-out starts",
        "attribute",
        "units",
        "effect [95 %]",
        "falls",
        "effect / SD",
        "largest side effect / SD",
    )
    for one in summary["steered"]:
        alone = "" if one["side_alone"] is None else f" (with one unit: {_show(one['side_alone'], '.2f')})"
        table.add_row(
            f"{one['attribute']} {one['direction']}",
            describe_units(one["units"]),
            _effect(one),
            f"{one['falls']} of {one['of']}",
            _show(one["main"], ".2f"),
            _show(one["side"], ".2f") + alone,
        )
    return table


def _behavior_table(summary: dict[str, Any]) -> Table:
    table = new_table(
        "Behaviors, on held-out starts",
        "behavior",
        "units",
        "gain [95 %]",
        "goal",
        "success",
        "falls",
        "attribute: without → with",
    )
    for one in summary["behaviors"]:
        table.add_row(
            one["name"] + ("" if one["reached"] else " (goal not reached)"),
            describe_units(one["units"]),
            f"{_show(one['gain'], '.2f')} [{_show(one['low'], '.2f')}, {_show(one['high'], '.2f')}]",
            f"{one['enough']:g}",
            f"{one['success']:.0%}",
            f"{one['falls']:.0%}",
            f"{one['attribute']}: {_show(one['unperturbed'], '.2f')} → {_show(one['value'], '.2f')}",
        )
    return table


def _controller_table(summary: dict[str, Any]) -> Table:
    table = new_table(
        "Controllers, on held-out starts", "attribute", "units", "kp / ki / limit", "error", "falls"
    )
    for one in summary["holds"]:
        table.add_row(
            one["attribute"] + ("" if one["holds"] else " (does not hold the target)"),
            describe_units(one["units"]),
            f"{one['kp']:.3g} / {one['ki']:.3g} / {one['limit']:g}",
            f"{_show(one['error'], '.2f')} (uncontrolled: {_show(one['uncontrolled'], '.2f')})",
            f"{one['falls']:.0%}",
        )
    return table


def dissection_remarks(summary: dict[str, Any]) -> list[str]:
    """Return what the tables of a summary do not say, one sentence or two per line."""
    attributes = summary["attributes"]
    hits = sum(attribute["hits"]["first"] for attribute in attributes)
    confirmed = sum(bool(one["first_match"] and one["first_match"]["confirmed"]) for one in attributes)
    lines = [
        f"The first match is a hit for {hits} of {len(attributes)} attributes, and probing confirms it for "
        f"{confirmed}. The dissection took {summary['rollouts']} roll-outs and {summary['minutes']:.1f} min.",
    ]
    if summary["shortened"]:
        lines.append(summary["shortened"])
    unwrapped = [attribute["name"] for attribute in attributes if attribute["unwrapped"]]
    if unwrapped:
        lines.append(f"Unwrapped before the transform: {', '.join(unwrapped)}.")
    lines += [f"{one['name']}: {one['flaw']}." for one in attributes if one["flaw"]]
    by_flaw: dict[str, list[str]] = {}
    for unit, flaw in summary["unit_flaws"].items():
        by_flaw.setdefault(flaw, []).append(unit)
    for flaw, units in by_flaw.items():
        more = ", …" if len(units) > MAX_LISTED else ""
        lines.append(f"† {len(units)} of the units: {flaw} ({', '.join(units[:MAX_LISTED])}{more}).")
    if any(match["rho_disagree"] for one in attributes for match in one["matches"][:_MATCHES]):
        lines.append("! The plain and the circular mean of the phase disagree. Trust the circular one.")
    for seed, steps in summary["too_short"]:
        lines.append(f"Left out: the episode of seed {seed}, whose {steps} steps are less than one window.")
    return lines


def _probed_name(one: dict[str, Any] | None) -> str:
    if one is None:
        return "none"
    return f"{one['unit']} = {one['value']:g}" + ("" if one["confirmed"] else " (not confirmed)")


def _effect(one: dict[str, Any] | None) -> str:
    if one is None:
        return ""
    return f"{_show(one['effect'], '+.2f')} [{_show(one['low'], '+.2f')}, {_show(one['high'], '+.2f')}]"


def _show(number: float | None, form: str) -> str:
    return "–" if number is None else format(number, form)
