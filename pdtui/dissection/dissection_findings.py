"""What a dissection found, what it did not, and what its figures cannot tell, in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pdtui.core.units import describe_units
from pdtui.dissection.steering.steering_summary import describe_steering


def describe_findings(summary: dict[str, Any]) -> dict[str, list[str]]:
    """Return the sentences of the report's first page, under their headings."""
    return {
        "What was found": _found(summary),
        "What was not found": _not_found(summary),
        "What these figures cannot tell": _cannot_tell(summary),
    }


def _found(summary: dict[str, Any]) -> list[str]:
    judged, lines = summary["judged"], []
    for attribute in summary["attributes"]:
        best = next((one for one in attribute["probed"] if one["confirmed"]), None)
        if best is not None:
            lines.append(_primitive(attribute, best))
    share = (
        f"{judged['confirmed']} of the {judged['pairs']} pairs of a unit and an attribute that were judged"
    )
    lines.insert(0, f"Confirmed: {share}, for {len(lines)} of {len(summary['attributes'])} attributes.")
    for one in summary["behaviors"]:
        if one["reached"]:
            lines.append(
                f"{one['name']}: {describe_units(one['units'])} reach the goal on {one['success']:.0%} of "
                f"the held-out starts, with falls on {one['falls']:.0%}; the gain is {one['gain']:.2g}, and "
                f"{one['rival']['gain']:.2g} with the best of as many random sets of units."
            )
    lines.append(describe_steering(summary["steering"]))
    lines += [f"{one['attribute']}: can be held at a target." for one in summary["holds"] if one["holds"]]
    return lines


def _primitive(attribute: dict[str, Any], one: dict[str, Any]) -> str:
    text = (
        f"{attribute['name']}: {one['unit']} held at {one['value']:g} changes it by {one['effect']:+.2g} "
        f"{attribute['unit']}".rstrip()
    )
    if one["held"] is not None:
        text += f", and by {one['held']['effect']:+.2g} when it is held for long"
    if not one["in_range"]:
        low, high = one["own_range"]
        end = one["at_end_of_range"]
        text += (
            f". By itself the unit only puts out {low:.2g} to {high:.2g}; at {end['value']:.2g} the effect "
            f"is {end['effect']:+.2g}" + ("" if end["passes"] else ", which is not confirmed")
        )
    return text + "."


def _not_found(summary: dict[str, Any]) -> list[str]:
    judged, lines = summary["judged"], []
    if judged["fewest_confirmed"] is None:
        lines.append(
            f"Nothing could be confirmed: with {judged['starts']} starts and {judged['controls']} random "
            f"units no p-value is below {judged['smallest_p']:.2g}, and the level is {judged['level']:g}. "
            "This is no evidence against any unit."
        )
    missing = [
        one["name"] for one in summary["attributes"] if not any(two["confirmed"] for two in one["probed"])
    ]
    if missing:
        lines.append(f"No unit is confirmed for: {', '.join(missing)}.")
    for attribute in summary["attributes"]:
        for one in attribute["probed"]:
            if one["passes"] and not one["confirmed"]:
                lines.append(
                    f"{attribute['name']}: {one['unit']} held at {one['value']:g} changes it by "
                    f"{one['effect']:+.2g} at first, but by {one['held']['effect']:+.2g} when it is held for "
                    "long: a passing change."
                )
    lost = [one["name"] for one in summary["behaviors"] if not one["reliable"]]
    if lost:
        lines.append(f"No stimulation reached the goal of: {', '.join(lost)}.")
    for one in summary["behaviors"]:
        if one["reliable"] and not one["reached"]:
            lines.append(
                f"{one['name']}: {describe_units(one['units'])} reach the goal, but the best of as many "
                f"random sets of units is about as good (a gain of {one['rival']['gain']:.2g} beside "
                f"{one['gain']:.2g}; p = {one['rival']['p']:.2g})."
            )
    lines += [
        f"{one['attribute']}: no controller holds it at a target."
        for one in summary["holds"]
        if not one["holds"]
    ]
    return lines or ["Nothing that was looked for is missing."]


def _cannot_tell(summary: dict[str, Any]) -> list[str]:
    judged = summary["judged"]
    lines = [
        f"Of the confirmed pairs, {judged['level']:.0%} may be false, on average. A pair that is not "
        f"confirmed may still be real: {judged['starts']} starts find large effects only."
    ]
    if judged["fewest_confirmed"] is not None and judged["fewest_confirmed"] > 1:
        lines.append(
            f"With {judged['starts']} starts and {judged['controls']} random units the smallest p-value is "
            f"{judged['smallest_p']:.2g}, so pairs are only confirmed if {judged['fewest_confirmed']} or "
            f"more of {judged['pairs']} are as clear as that."
        )
    lines += [
        "A confirmed unit moves the attribute more than random units held in the same way do. That does not "
        "say that it moves nothing else, or that the policy uses it for that: see the side effects."
    ]
    outside = judged["ranges"]["out_of_range"]
    if outside["judged"]:
        lines.append(
            f"{outside['judged']} of {judged['pairs']} pairs were judged at an output that the unit never "
            "has by itself (‡). These say what an intervention does, not what the unit does in the policy."
        )
    lines.append(
        "Starts are states of undisturbed walks on the robot's own ground. Pushes, other ground, and "
        "behaviors that are held for longer are for `pdtui evaluate`."
    )
    noisy = _names(summary["attributes"], "ceiling", 0.5)
    if noisy:
        lines.append(
            f"Probing hardly repeats itself (noise ceiling below 0.5) for {', '.join(noisy)}: no ranking can "
            "agree with it there."
        )
    return lines


def _names(attributes: Sequence[dict[str, Any]], figure: str, least: float) -> list[str]:
    """Return the attributes for which a figure is below a value, or does not exist."""
    return [one["name"] for one in attributes if one["hits"][figure] is None or one["hits"][figure] < least]
