"""Findings of a dissection as plain data, which ``--json`` prints and the tables show."""

from __future__ import annotations

import math
from typing import Any

from pdtui.core.units import format_unit
from pdtui.dissection.attribute_movers import AttributeMover
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.search_task_into_map import draft_task_behavior
from pdtui.dissection.steering.steering_summary import summarize_steering
from pdtui.probing.matching_hits import TOP_MATCHES, measure_matching_hits
from pdtui.probing.primitive_confirmation import EffectVerdict, PrimitiveConfirmation
from pdtui.robots.task import average_figures
from pdtui.search.behavior_search import BehaviorSearchResult
from pdtui.search.controller_search import ControllerSearchResult
from pdtui.search.task_search import TaskSearchResult
from pdtui.spectra.matching_presets import list_preset_values


def summarize_dissection(dissection: Dissection, matches: int = 10) -> dict[str, Any]:
    """Return the findings as data for JSON. Numbers that do not exist are None.

    For each attribute at most `matches` matches are listed, the nearest first.
    """
    matching, layers = dissection.matching, dissection.layers
    return {
        "robot": dissection.robot,
        "robot_options": dict(dissection.robot_options),
        "policy": dissection.policy,
        "sha256": dissection.policy_hash,
        "preset": dissection.preset.name,
        "settings": list_preset_values(dissection.preset),
        "settings_changed": list(dissection.preset.changed),
        "seed": dissection.seed,
        "episodes": list(matching.used),
        "too_short": [list(pair) for pair in matching.skipped],
        "unit_flaws": {format_unit(unit, layers): flaw for unit, flaw in matching.unit_flaws.items()},
        "attributes": [
            _attribute(dissection, column, matches) for column in range(len(dissection.attributes))
        ],
        "judged": _judgment(dissection),
        "shortened": dissection.shortened,
        "movable": [dissection.attributes[column].name for column in dissection.movable],
        "steered": [_mover(dissection, one) for one in dissection.attribute_movers],
        "steering": summarize_steering(dissection.steering, dissection.attributes),
        "side_effects": _side_effects(dissection),
        "behaviors": [_behavior(found, layers) for found in dissection.behaviors],
        "tasks": [_task(found, dissection) for found in dissection.tasks],
        "holds": [_controller(found, layers) for found in dissection.controllers],
        "rollouts": dissection.rollouts,
        "control_steps": dissection.control_steps,
        "minutes": round(dissection.minutes, 2),
    }


def _task(found: TaskSearchResult, dissection: Dissection) -> dict[str, Any]:
    behavior = draft_task_behavior(found, dissection.layers, dissection.dt)
    return {
        "name": behavior.name,
        "units": dict(behavior.magnitudes),
        "period": behavior.period,
        "walks": len(found.verdicts),
        "done": found.done,
        "by_itself": found.done_without,
        "figures": average_figures(found.verdicts),
    }


def _attribute(dissection: Dissection, column: int, matches: int) -> dict[str, Any]:
    attribute = dissection.attributes[column]
    matching, phase, layers = dissection.matching, dissection.phase, dissection.layers
    ranked = matching.ranked_units(column)
    judgment = dissection.judgment
    rate = measure_matching_hits(
        column, dissection.screen, matching, judgment.control_effects, judgment.controls
    )
    first = judgment.of_pair(int(ranked[0]), column) if ranked.size else None
    return {
        "name": attribute.name,
        "unit": attribute.unit,
        "flaw": matching.flaws.get(attribute.name),
        "unwrapped": attribute.wraps and dissection.preset.angles == "unwrapped",
        # An attribute that matching left out has no predominant frequency.
        "frequency": float(dissection.preset.frequencies(dissection.dt)[phase.bins[column]])
        if ranked.size
        else None,
        "matches": [
            {
                "unit": format_unit(int(unit), layers),
                "flaw": matching.unit_flaws.get(int(unit)),
                "discrepancy": _number(matching.discrepancy[column, unit]),
                "level_share": _number(matching.level_share[column, unit]),
                "rho": _number(phase.plain[column, unit]),
                "rho_circular": _number(phase.circular[column, unit]),
                "rho_disagree": bool(phase.disagree[column, unit]),
            }
            for unit in ranked[:matches]
        ],
        "first_match": None if first is None else _confirmation(dissection, column, first),
        "probed": [_confirmation(dissection, column, one) for one in judgment.of_attribute(column)],
        "hits": {
            "first": rate.first,
            **{f"best_{count}": _number(share) for count, share in zip(TOP_MATCHES, rate.best, strict=True)},
            "random": _number(rate.random),
            "rank_correlation": _number(rate.correlation),
            **_numbers(rate, "held_out_matching", "held_out_probing", "ceiling", "disattenuated_matching"),
        },
    }


def _confirmation(dissection: Dissection, column: int, one: PrimitiveConfirmation) -> dict[str, Any]:
    rho, measured = float(dissection.phase.rho(dissection.preset)[column, one.unit]), one.verdict.measured
    low, high = dissection.judgment.own_range[one.unit]
    return {
        "unit": format_unit(one.unit, dissection.layers),
        **_verdict(one.verdict),
        "confirmed": one.confirmed,
        "own_range": [float(low), float(high)],
        "in_range": one.in_range,
        "at_end_of_range": _verdict(one.own_range),
        "held": None if one.held is None else _verdict(one.held),
        "both_ways": one.both_ways,
        "survived": dissection.refined.safe_magnitude(one.unit),
        "rho": _number(rho),
        # ρ > 0 means that a higher output goes with a higher attribute.
        "sign_agrees": bool(rho * one.verdict.value * measured.effect > 0),
    }


def _verdict(one: EffectVerdict) -> dict[str, Any]:
    return {
        "value": one.value,
        **_numbers(one.measured, "effect", "low", "high"),
        "falls": one.measured.falls,
        "of": one.measured.of,
        **_numbers(one, "flip_p", "corrected_p"),
        "random_p": one.random_p,
        "passes": one.confirmed,
    }


def _judgment(dissection: Dissection) -> dict[str, Any]:
    judgment = dissection.judgment
    pairs = judgment.confirmations
    ranges = {
        name: {
            "judged": len(some),
            "confirmed": sum(one.verdict.confirmed for one in some),
            "at_end_of_range": sum(one.own_range.confirmed for one in some),
        }
        for name, some in (
            ("in_range", [one for one in pairs if one.in_range]),
            ("out_of_range", [one for one in pairs if not one.in_range]),
        )
    }
    return {
        "level": judgment.level,
        "starts": judgment.starts,
        "controls": len(judgment.controls),
        "smallest_p": judgment.smallest_p,
        "fewest_confirmed": judgment.fewest_confirmed,
        "pairs": len(pairs),
        "passed": sum(one.verdict.confirmed for one in pairs),
        "passing_by": sum(one.verdict.confirmed and not one.confirmed for one in pairs),
        "confirmed": sum(one.confirmed for one in pairs),
        "ranges": ranges,
    }


def _mover(dissection: Dissection, one: AttributeMover) -> dict[str, Any]:
    return {
        "attribute": dissection.attributes[one.column].name,
        "direction": "up" if one.sign > 0 else "down",
        "units": one.stimulation.by_address(dissection.layers),
        **_numbers(one.measured, "effect", "low", "high"),
        "falls": one.measured.falls,
        "of": one.measured.of,
        **_numbers(one, "main", "side"),
        "side_alone": None if one.alone is None else _number(one.alone),
    }


def _side_effects(dissection: Dissection) -> dict[str, Any]:
    """Return effects of refined units × attributes at the largest outputs, in standard deviations."""
    matrices = {
        f"{value:g}": [[_number(cell) for cell in row] for row in parts]
        for value, parts in dissection.side_effects().items()
    }
    return {
        "units": [format_unit(unit, dissection.layers) for unit in dissection.refined.units],
        "controls": [format_unit(unit, dissection.layers) for unit in dissection.judgment.controls],
        "attributes": [attribute.name for attribute in dissection.attributes],
        "by_value": matrices,
    }


def _behavior(found: BehaviorSearchResult, layers: tuple[int, ...]) -> dict[str, Any]:
    return {
        "name": found.goal.name,
        "attribute": found.goal.aim.attribute,
        "direction": found.goal.aim.direction,
        "enough": found.goal.enough,
        "units": found.stimulation.by_address(layers),
        "reached": found.reached,
        "effect": _number(found.change.effect),
        "gain": _number(found.gain.effect),
        **_numbers(found.gain, "low", "high"),
        **_numbers(found, "success", "falls", "value", "unperturbed", "score", "search_score"),
        "rollouts": found.rollouts,
        "reliable": found.reliable,
        "rival": {
            "units": found.rival.by_address(layers),
            "gain": _number(found.rival_gain),
            "p": _number(found.rival_p),
        },
    }


def _controller(found: ControllerSearchResult, layers: tuple[int, ...]) -> dict[str, Any]:
    return {
        "attribute": found.pid.attribute,
        "units": found.weights.by_address(layers),
        **_numbers(found.pid, "kp", "ki", "kd", "limit"),
        "holds": found.holds,
        **_numbers(found, "error", "uncontrolled", "falls"),
        "targets": list(found.targets),
        "relative": found.relative,
    }


def _numbers(source: object, *names: str) -> dict[str, float | None]:
    return {name: _number(getattr(source, name)) for name in names}


def _number(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None
