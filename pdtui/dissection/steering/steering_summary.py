"""A comparison of ways to steer as plain data, as tables and in a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

from rich.table import Table

from pdtui.core.attributes import Attribute
from pdtui.core.console.text_tables import new_table
from pdtui.dissection.steering.steering_candidates import BASELINES, SteeringMethod
from pdtui.dissection.steering.steering_results import SteeringComparison, SteeringResult


def summarize_steering(steering: SteeringComparison, attributes: Sequence[Attribute]) -> dict[str, Any]:
    """Return a comparison as data for JSON."""
    return {
        "choosing": steering.choosing,
        "judging": steering.judging,
        "cases": 2 * len(steering.columns),
        "attributes": [attributes[column].name for column in steering.columns],
        "methods": [
            _summarize_method(method, tried, [one for one in steering.results if one.method is method])
            for method, tried in steering.tried.items()
        ],
        "probes": {
            attributes[one.column].name: {"layer": one.layer, "r2": one.r2} for one in steering.probes
        },
        "results": [_summarize_result(one, attributes) for one in steering.results],
    }


def steering_tables(summary: dict[str, Any]) -> list[Table]:
    """Return the tables of a summary: a row for each method, and one for each attribute and direction."""
    cases = summary["cases"]
    methods = new_table(
        f"Ways to steer {cases // 2} attributes up and down, on {summary['judging']} held-out starts; "
        "effects are medians in SD",
        *("way", "tried", "moves it", "more than random", "effect", "side effect", "falls"),
    )
    for one in summary["methods"]:
        methods.add_row(
            one["method"],
            str(one["tried"]),
            f"{one['moves']} of {cases}",
            "–" if one["steers"] is None else f"{one['steers']} of {cases}",
            _show(one["main"]),
            _show(one["side"]),
            f"{one['falls']} of {one['of']}",
        )
    strongest = new_table(
        "Strongest ways to steer; R² is of the linear probe, side effects are in SD",
        *("attribute", "R²", "way", "effect [95 %]", "in SD", "side", "safe up to"),
    )
    for attribute in summary["attributes"]:
        for direction in ("up", "down"):
            probe = summary["probes"].get(attribute)
            cells = [f"{attribute} {direction}", "–" if probe is None else f"{probe['r2']:.2f}"]
            best = _find_strongest(summary["results"], attribute, direction)
            if best is None:
                strongest.add_row(*cells, "none", *[""] * 4)
                continue
            strongest.add_row(
                *cells,
                f"{best['method']}: {best['source']}, {best['dose']:+g}",
                f"{best['effect']:+.2f} [{best['low']:+.2f}, {best['high']:+.2f}]",
                _show(best["main"]),
                _show(best["side"]),
                f"{best['largest_dose']:+g}",
            )
    return [methods, strongest]


def _find_strongest(
    results: Sequence[dict[str, Any]], attribute: str, direction: str
) -> dict[str, Any] | None:
    own = [
        one
        for one in results
        if (one["attribute"], one["direction"]) == (attribute, direction)
        and one["steers"]
        and one["p_random"] is not None
    ]
    return max(own, key=lambda one: float(one["main"]), default=None)


def describe_steering(summary: dict[str, Any]) -> str:
    """Return in a sentence for how many attributes and directions each method steers."""
    compared = [one for one in summary["methods"] if one["steers"] is not None]
    parts = ", ".join(f"{one['method']} {one['steers']}" for one in compared)
    return (
        f"Ways to steer, of {summary['cases']} attributes and directions: {parts}. Each took the smallest "
        f"dose that was enough on {summary['choosing']} starts; on {summary['judging']} others, it had to "
        "move the attribute more than units or directions drawn at random did."
    )


def _summarize_method(
    method: SteeringMethod, tried: int, results: Sequence[SteeringResult]
) -> dict[str, Any]:
    """Return how many results count, and the medians of those."""
    steering = [one for one in results if one.beats_baseline]
    counted = [one for one in results if one.is_significant] if method in BASELINES else steering
    return {
        "method": str(method),
        "tried": tried,
        "moves": sum(one.is_significant for one in results),
        "steers": None if method in BASELINES else len(steering),
        "main": median(one.main for one in counted) if counted else None,
        "side": median(one.side for one in counted) if counted else None,
        "falls": sum(one.measured.falls or 0 for one in results),
        "of": sum(one.measured.of or 0 for one in results),
    }


def _summarize_result(one: SteeringResult, attributes: Sequence[Attribute]) -> dict[str, Any]:
    measured = one.measured
    return {
        "attribute": attributes[one.column].name,
        "direction": "up" if one.sign > 0 else "down",
        "method": str(one.method),
        "source": one.candidate.source,
        "dose": one.candidate.dose,
        "largest_dose": one.largest_dose,
        "effect": measured.effect,
        "low": measured.low,
        "high": measured.high,
        "falls": measured.falls,
        "of": measured.of,
        "main": one.main,
        "side": one.side,
        "p": one.p,
        "p_random": one.p_random,
        "steers": one.beats_baseline,
    }


def _show_effect(one: dict[str, Any] | None) -> str:
    if one is None:
        return "none"
    return f"{one['main']:.2f} / {one['side']:.2f}" + ("" if one["steers"] else " ?")


def _show(number: float | None) -> str:
    return "–" if number is None else f"{number:.2f}"
