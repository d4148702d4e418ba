"""The tables of `pdtui evaluate --gait`."""

from __future__ import annotations

import math

from rich.console import Group

from pdtui.core.console.text_tables import format_seed_range, new_facts_table, new_table
from pdtui.core.outcome import describe_outcomes
from pdtui.evaluation.gait.gait_evaluation import STEPS_BEFORE, GaitEvaluation, MeanWithDeviation
from pdtui.evaluation.gait.quadruped_gaits import IRREGULAR, PLACES
from pdtui.evaluation.gait.walk_metrics import CONTACT_HEIGHT


def gait_tables(result: GaitEvaluation) -> Group:
    """Return one row per foot, and the figures of the whole robot."""
    table = new_table(
        f"Gait of {result.robot}, policy {result.policy} alone, {format_seed_range(result.seeds)}, "
        f"{result.steps} steps each",
        *("foot", "touchdowns (1/s)", "duty factor", "clearance (m)", "slip in stance (m/s)"),
    )
    for foot in result.feet:
        table.add_row(
            foot.name,
            _format(foot.touchdown_rate, ".1f"),
            _format(foot.duty_factor, ".2f"),
            _format(foot.clearance, ".3f"),
            _format(foot.slip, ".2f"),
        )
    table.caption = _explain(result)
    facts = [
        ("walking speed (m/s)", _format(result.speed, ".2f")),
        ("airborne", f"{_format(result.airborne, '.0%')} of the time"),
        ("feet on the ground", ", ".join(f"{n}: {share:.0%}" for n, share in enumerate(result.feet_down))),
    ]
    if result.alternation is not None:
        facts.append(("feet alternate", f"{_format(result.alternation, '.0%')} of touchdowns"))
    if result.gait:
        near = result.gait if result.gait == IRREGULAR else f"nearest to a {result.gait}"
        lags = ", ".join(f"{place} {lag:.2f}" for place, lag in zip(PLACES, result.lags, strict=True))
        facts.append(("gait", f"{near}; lags in strides: {lags}; regularity {result.regularity:.2f}"))
    degrees = MeanWithDeviation(math.degrees(result.tilt.mean), math.degrees(result.tilt.deviation))
    facts += [
        ("tilt of the trunk", f"{_format(degrees, '.1f')}°"),
        ("outcomes", describe_outcomes(result.outcomes, len(result.seeds))),
    ]
    return Group(table, new_facts_table(facts))


def _explain(result: GaitEvaluation) -> str:
    told = (
        f"Contacts are the simulator's, once per control step of {result.dt:g} s"
        if result.contacts_by == "simulator"
        else f"Contacts are estimated: a foot stands whose sole is within {CONTACT_HEIGHT * 100:g} cm of the "
        "lowest of the walk"
    )
    return (
        f"{told}. Mean ± standard deviation over walks, after {STEPS_BEFORE} steps that are not measured. "
        "Clearance: largest height of the sole in a swing above the stance before. Slip: how fast the sole "
        "slides while the foot stands."
    )


def _format(figure: MeanWithDeviation, form: str) -> str:
    if math.isnan(figure.mean):
        return "–"
    return f"{figure.mean:{form}} ± {figure.deviation:{form}}"
