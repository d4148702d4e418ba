"""What `pdtui dissect` prints: tables, remarks on what they do not say, and findings in plain words."""

from __future__ import annotations

from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from pdtui.core.units import MAX_LISTED
from pdtui.dissection.dissection_findings import describe_findings
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarize_dissection
from pdtui.dissection.dissection_tables import LISTED_MATCHES, dissection_tables


def render_dissection(dissection: Dissection) -> RenderableType:
    """Return what `pdtui dissect` prints: the tables, the remarks, and the findings in plain words."""
    summary = summarize_dissection(dissection)
    parts: list[RenderableType] = [*dissection_tables(summary)]
    parts += [Text(line) for line in dissection_remarks(summary)]
    for heading, lines in describe_findings(summary).items():
        parts += [Text(f"\n{heading}", style="bold"), *(Text(f"- {line}") for line in lines)]
    return Group(*parts)


def dissection_remarks(summary: dict[str, Any]) -> list[str]:
    """Return what the tables of a summary do not say, one sentence or two per line."""
    attributes = summary["attributes"]
    hits = sum(attribute["hits"]["first"] for attribute in attributes)
    confirmed = sum(bool(one["first_match"] and one["first_match"]["confirmed"]) for one in attributes)
    lines = [
        f"The first match is a hit for {hits} of {len(attributes)} attributes, and probing confirms it for "
        f"{confirmed}. The dissection took {summary['rollouts']} roll-outs and {summary['minutes']:.1f} min."
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
    if summary["judged"]["ranges"]["out_of_range"]["judged"]:
        lines.append("‡ The unit never puts out such a value by itself.")
    if any(match["rho_disagree"] for one in attributes for match in one["matches"][:LISTED_MATCHES]):
        lines.append("! The plain and the circular mean of the phase disagree. Trust the circular one.")
    for seed, steps in summary["too_short"]:
        lines.append(f"Left out: the episode of seed {seed}, whose {steps} steps are less than one window.")
    return lines
