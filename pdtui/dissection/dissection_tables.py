"""What a dissection found, as tables for a terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from pdtui.core.text_tables import new_table
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarise_dissection
from pdtui.probing.confirmation import TOP_MATCHES

_LISTED = 6
_MATCHES = 3


def render_dissection(dissection: Dissection) -> RenderableType:
    """The tables that `pdtui dissect` prints."""
    summary = summarise_dissection(dissection)
    return Group(*dissection_tables(summary), *(Text(line) for line in dissection_remarks(summary)))


def dissection_tables(summary: dict[str, Any]) -> list[Table]:
    """The tables of a summary, for whoever shows them; every cell is a text."""
    found = [_matching_table(summary), _probing_table(summary), _steered_table(summary)]
    if summary["behaviors"]:
        found.append(_behavior_table(summary))
    if summary["holds"]:
        found.append(_hold_table(summary))
    return found


def _matching_table(summary: dict[str, Any]) -> Table:
    title = f"Matching ({' '.join([summary['preset'], *summary['settings_changed']])}): nearest units"
    table = new_table(title, "attribute", "at Hz", "unit", "discrepancy", "mean level", "ρ", "ρ circular")
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
        "Probing: what units do",
        "attribute",
        "best unit",
        "effect [95 %]",
        "both ways",
        "first match",
        "its effect [95 %]",
        "hits: first / " + " / ".join(f"best {count}" for count in TOP_MATCHES) + " / random",
        "held-out rank corr.: matching / probing",
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


def _steered_table(summary: dict[str, Any]) -> Table:
    table = new_table(
        "Up and down, on starts that chose nothing",
        "attribute",
        "units",
        "effect [95 %]",
        "falls",
        "in deviations",
        "largest side effect",
    )
    for one in summary["steered"]:
        alone = "" if one["side_alone"] is None else f" (one unit alone: {_show(one['side_alone'], '.2f')})"
        table.add_row(
            f"{one['attribute']} {one['direction']}",
            _listed(one["units"]),
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
        "enough",
        "success",
        "falls",
        "attribute: without → with",
    )
    for one in summary["behaviors"]:
        table.add_row(
            one["name"] + ("" if one["reached"] else " (not reached)"),
            _listed(one["units"]),
            f"{_show(one['gain'], '.2f')} [{_show(one['low'], '.2f')}, {_show(one['high'], '.2f')}]",
            f"{one['enough']:g}",
            f"{one['success']:.0%}",
            f"{one['falls']:.0%}",
            f"{one['attribute']}: {_show(one['unperturbed'], '.2f')} → {_show(one['value'], '.2f')}",
        )
    return table


def _hold_table(summary: dict[str, Any]) -> Table:
    table = new_table(
        "Controllers, on held-out starts", "attribute", "units", "kp / ki / limit", "error", "falls"
    )
    for one in summary["holds"]:
        table.add_row(
            one["attribute"] + ("" if one["holds"] else " (does not hold)"),
            _listed(one["units"]),
            f"{one['kp']:.3g} / {one['ki']:.3g} / {one['limit']:g}",
            f"{_show(one['error'], '.2f')} (without: {_show(one['uncontrolled'], '.2f')})",
            f"{one['falls']:.0%}",
        )
    return table


def dissection_remarks(summary: dict[str, Any]) -> list[str]:
    """What the tables of a summary leave to say, a line each."""
    attributes = summary["attributes"]
    hits = sum(attribute["hits"]["first"] for attribute in attributes)
    confirmed = sum(bool(one["first_match"] and one["first_match"]["confirmed"]) for one in attributes)
    lines = [
        f"Matching alone: the first match is a hit for {hits} of {len(attributes)} attributes and confirmed "
        f"by probing for {confirmed}. {summary['rollouts']} roll-outs, {summary['minutes']:.1f} min.",
    ]
    if summary["shortened"]:
        lines.append(summary["shortened"])
    unwrapped = [attribute["name"] for attribute in attributes if attribute["unwrapped"]]
    if unwrapped:
        lines.append(f"Unwrapped before the transform: {', '.join(unwrapped)}.")
    lines += [f"{one['name']}: {one['flaw']}." for one in attributes if one["flaw"]]
    lines += _unit_remarks(summary)
    if any(match["rho_disagree"] for one in attributes for match in one["matches"][:_MATCHES]):
        lines.append("! plain and circular mean of the phase disagree; the circular one is sound.")
    for seed, steps in summary["too_short"]:
        lines.append(f"Left out: the episode of seed {seed} has {steps} steps, less than one window.")
    return lines


def _unit_remarks(summary: dict[str, Any]) -> list[str]:
    """One line for each kind of flaw, with the units that have it."""
    by_flaw: dict[str, list[str]] = {}
    for unit, flaw in summary["unit_flaws"].items():
        by_flaw.setdefault(flaw, []).append(unit)
    return [
        f"† {len(units)} of the units: {flaw} ({', '.join(units[:_LISTED])}"
        + (", …)." if len(units) > _LISTED else ").")
        for flaw, units in by_flaw.items()
    ]


def _probed_name(one: dict[str, Any] | None) -> str:
    if one is None:
        return "none"
    return f"{one['unit']} = {one['value']:g}" + ("" if one["confirmed"] else " (not confirmed)")


def _effect(one: dict[str, Any] | None) -> str:
    if one is None:
        return ""
    return f"{_show(one['effect'], '+.2f')} [{_show(one['low'], '+.2f')}, {_show(one['high'], '+.2f')}]"


def _listed(units: dict[str, float]) -> str:
    if len(units) > _LISTED:
        return f"{len(units)} units"
    return ", ".join(f"{unit} = {value:g}" for unit, value in units.items())


def _show(number: float | None, form: str) -> str:
    return "–" if number is None else format(number, form)
