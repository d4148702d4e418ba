"""From a dissection to a stimulation-evoked map, as text to be read and edited."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import tomlkit

from pdtui.core.units import NO_STIMULATION, Stimulation, format_unit
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.key_allocator import KeyAllocator
from pdtui.probing.confirmation import PrimitiveConfirmation, rank_probed_units
from pdtui.robots.robot_goals import HoldGoal
from pdtui.search.behavior_search import BehaviorSearchResult
from pdtui.search.controller_search import ControllerSearchResult
from pdtui.stimulation.map_toml import block_table, inline_table, outputs_table, table_array
from pdtui.stimulation.map_writer import effect_table
from pdtui.stimulation.stimulation_map import SCHEMA

# Below, v = c ρ would need a magnitude that says nothing: such a behavior names the unit instead.
_USEFUL_RHO = 0.1
_LISTED = 6


def draft_map(dissection: Dissection) -> str:
    """The map as TOML.

    Primitives are the confirmed unit of the largest effect for each attribute that a behavior may use; for a
    robot that has none of the usual ones, for each that it was dissected for.
    Behaviors that did not reach their goal on the held-out starts are left out, and a comment says how far
    they came.
    """
    document = tomlkit.document()
    primitives = _primitives(dissection)
    for line in _header(dissection, {str(entry["attribute"]) for entry in primitives}):
        document.add(tomlkit.comment(line))
    document.add("schema", tomlkit.item(SCHEMA))
    document.add("robot", tomlkit.item(dissection.robot))
    chosen = {name: value for name, value in asdict(dissection.import_options).items() if value}
    policy = {"name": dissection.policy, "sha256": dissection.policy_hash, **chosen}
    document.add("policy", block_table(policy))
    document.add("keys", block_table({"default": "space"}))
    names = {
        str(entry["unit"]): (str(entry["name"]), float(entry["rho"]))
        for entry in primitives
        if abs(float(entry["rho"])) >= _USEFUL_RHO
    }
    if primitives:
        document.add("primitives", table_array(primitives))
    behaviors = [_behavior(found, dissection, names) for found in dissection.behaviors if found.reached]
    behaviors += [_hold(held, dissection) for held in dissection.controllers if held.holds]
    behaviors += _steered(dissection, {str(entry["key"]) for entry in behaviors})
    if behaviors:
        document.add("behaviors", table_array(behaviors))
    return tomlkit.dumps(document)


def _header(dissection: Dissection, steered: set[str]) -> list[str]:
    lines = [
        f"Proposed by dissecting {dissection.policy_hash[:12]}… with preset '{dissection.preset}' and "
        f"seed {dissection.seed}: {dissection.rollouts} roll-outs.",
        "Effects are changes against the unperturbed roll-out, with 95 % intervals over starting states.",
    ]
    if dissection.shortened:
        lines.append(dissection.shortened)
    missing = [name for name in _nameable(dissection) if name not in steered]
    if missing:
        lines.append(f"No unit was confirmed for: {', '.join(missing)}.")
    for found in dissection.behaviors:
        if not found.reached:
            lines.append(
                f"Not found: {found.goal.name}. The best, {_describe(found.stimulation, dissection.layers)}, "
                f"gained enough on {found.success:.0%} of the held-out starts and fell on {found.falls:.0%}."
            )
    for held in dissection.controllers:
        if not held.holds:
            lines.append(
                f"Not found: {_hold_goal(held, dissection).name}. The best controller is off by "
                f"{held.error:.2f}, without {held.uncontrolled:.2f}; it fell on {held.falls:.0%}."
            )
    return lines


def _describe(stimulation: Stimulation, layers: tuple[int, ...]) -> str:
    addresses = stimulation.by_address(layers)
    if len(addresses) > _LISTED:
        return f"{len(addresses)} units"
    return ", ".join(f"{unit} = {value:g}" for unit, value in addresses.items())


def _primitives(dissection: Dissection) -> list[dict[str, Any]]:
    entries: list[dict[str, Any]] = []
    for attribute, name in _nameable(dissection).items():
        column = dissection.column(attribute)
        best = rank_probed_units(column, dissection.screen, dissection.refined, dissection.seed)
        # Without a phase there is no ρ, and without ρ no magnitude c: such a unit is no primitive.
        rho = dissection.phase.rho(dissection.preset)[column]
        known = [one for one in best if one.confirmed and np.isfinite(rho[one.unit])]
        if known:
            entries.append(_primitive(name, attribute, column, known[0], dissection))
    return entries


def _nameable(dissection: Dissection) -> dict[str, str]:
    """Attributes that get a primitive, and its name."""
    names = [attribute.name for attribute in dissection.attributes]
    usual = {attribute: name for attribute, name in dissection.goals.primitives.items() if attribute in names}
    return usual or {names[column]: names[column] for column in dissection.movable}


def _primitive(
    name: str, attribute: str, column: int, best: PrimitiveConfirmation, dissection: Dissection
) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "name": name,
        "attribute": attribute,
        "unit": format_unit(best.unit, dissection.layers),
        "rho": round(float(dissection.phase.rho(dissection.preset)[column, best.unit]), 4),
    }
    discrepancy = float(dissection.matching.discrepancy[column, best.unit])
    if np.isfinite(discrepancy):
        entry["discrepancy"] = float(f"{discrepancy:.4g}")
    return entry | {"value": best.value, "measured": effect_table(best.measured)}


def _behavior(
    found: BehaviorSearchResult, dissection: Dissection, names: dict[str, tuple[str, float]]
) -> dict[str, Any]:
    magnitudes: dict[str, float] = {}
    for unit, value in zip(found.stimulation.units, found.stimulation.values, strict=True):
        address = format_unit(unit, dissection.layers)
        if address in names:
            name, rho = names[address]
            magnitudes[name] = float(f"{value / rho:.8g}")
        else:
            magnitudes[address] = value
    goal = found.goal
    return {
        "name": goal.name,
        "key": goal.key,
        "says": goal.says,
        "magnitudes": outputs_table(magnitudes),
        "aim": inline_table({"attribute": goal.aim.attribute, "direction": goal.aim.direction}),
        "measured": effect_table(found.change),
    }


def _steered(dissection: Dissection, taken: set[str]) -> list[dict[str, Any]]:
    """Up and down for every attribute that no goal moves that way already, as long as there are keys."""
    aimed = {(one.goal.aim.attribute, one.goal.aim.sign) for one in dissection.behaviors if one.reached}
    keys, pairs, entries = KeyAllocator(taken), dict[str, tuple[str, str] | None](), []
    for one in dissection.attribute_movers:
        name = dissection.attributes[one.column].name
        if (name, one.sign) in aimed:
            continue
        if name not in pairs:
            pairs[name] = keys.take_pair(name)
        pair = pairs[name]
        if pair is None:
            continue
        says = f"{'raises' if one.sign > 0 else 'lowers'} {name}"
        if one.alone is not None:
            says += f"; the second unit takes side effects from {one.alone:.2g} to {one.side:.2g} deviations"
        entries.append(
            {
                "name": f"{name} {'up' if one.sign > 0 else 'down'}",
                "key": pair[0 if one.sign > 0 else 1],
                "says": says,
                "magnitudes": outputs_table(one.stimulation.by_address(dissection.layers)),
                "aim": inline_table({"attribute": name, "direction": "raise" if one.sign > 0 else "lower"}),
                "measured": effect_table(one.measured),
            }
        )
    return entries


def _hold(held: ControllerSearchResult, dissection: Dissection) -> dict[str, Any]:
    goal = _hold_goal(held, dissection)
    pid, layers = held.pid, dissection.layers
    gains = {"kp": pid.kp, "ki": pid.ki, "kd": pid.kd, "limit": pid.limit, "step": pid.step}
    base = Stimulation(held.weights.units, held.base) if held.base else NO_STIMULATION
    # By address even where a primitive has the unit: the controller was measured with these very weights.
    entry = {
        "name": goal.name,
        "key": goal.key,
        "says": goal.says,
        "mode": "pid",
        "magnitudes": outputs_table(held.weights.by_address(layers)),
        "base": outputs_table(base.by_address(layers)),
        "pid": inline_table({"attribute": pid.attribute} | {k: float(f"{v:.4g}") for k, v in gains.items()}),
    }
    return {field: value for field, value in entry.items() if field != "base" or held.base}


def _hold_goal(held: ControllerSearchResult, dissection: Dissection) -> HoldGoal:
    return next(goal for goal in dissection.goals.holds if goal.attribute == held.pid.attribute)
