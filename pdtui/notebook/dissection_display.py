"""What a notebook shows of a dissection: every pair of a unit and an attribute that was judged."""

from __future__ import annotations

from typing import Any

from pdtui.notebook.sortable_table import render_sortable_table

PAIR_COLUMNS = (
    *("attribute", "attribute_unit", "unit", "value", "effect", "low", "high", "falls", "of"),
    *("flip_p", "random_p", "corrected_p", "confirmed", "in_range", "both_ways", "rho"),
)
"""Columns of the table, which are the fields of the summary's ``probed`` entries."""


def list_judged_pairs(summary: dict[str, Any]) -> dict[str, list[Any]]:
    """Return the columns of the table of all judged pairs, from the summary of a dissection."""
    pairs = [
        {**one, "attribute": attribute["name"], "attribute_unit": attribute["unit"]}
        for attribute in summary["attributes"]
        for one in attribute["probed"]
    ]
    return {name: [pair[name] for pair in pairs] for name in PAIR_COLUMNS}


def dissection_html(title: str, summary: dict[str, Any]) -> str:
    """Return the table of all judged pairs as HTML; a click on a heading sorts it."""
    columns = list_judged_pairs(summary)
    return render_sortable_table(title, PAIR_COLUMNS, list(zip(*columns.values(), strict=True)))
