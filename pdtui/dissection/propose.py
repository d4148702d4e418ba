"""From a dissection to a stimulation-evoked map, as text to be read and edited."""

from __future__ import annotations

from typing import Any

import numpy as np
import tomlkit

from pdtui.dissection.combine import Found
from pdtui.dissection.confirm import Confirmation, best_probed
from pdtui.dissection.findings import Dissection
from pdtui.dissection.hold import Held
from pdtui.policies.units import Stimulation, format_unit
from pdtui.stimulation.maps import SCHEMA, Measured

_PRIMITIVES = {
    "vx": "forward",
    "vy": "sidestep",
    "speed": "pace",
    "yaw": "heading",
    "yaw rate": "turn",
    "height": "height",
}
_HOLDS = {
    "yaw": ("hold heading", "h", "keeps the heading that the arrow keys set"),
    "speed": ("hold speed", "g", "keeps the speed that the arrow keys set"),
}
# Below, v = c ρ would need a magnitude that says nothing: such a behavior names the unit instead.
_USEFUL_RHO = 0.1


def propose(dissection: Dissection) -> str:
    """The map as TOML.

    Primitives are the confirmed unit of the largest effect for each attribute that a behavior may use.
    Behaviors that did not reach their goal on the held-out starts are left out, and a comment says how far
    they came.
    """
    document = tomlkit.document()
    primitives = _primitives(dissection)
    for line in _header(dissection, {str(entry["attribute"]) for entry in primitives}):
        document.add(tomlkit.comment(line))
    document.add("schema", tomlkit.item(SCHEMA))
    document.add("robot", tomlkit.item(dissection.robot))
    document.add("policy", _table({"name": dissection.policy, "sha256": dissection.policy_hash}))
    document.add("keys", _table({"default": "space"}))
    names = {
        str(entry["unit"]): (str(entry["name"]), float(entry["rho"]))
        for entry in primitives
        if abs(float(entry["rho"])) >= _USEFUL_RHO
    }
    if primitives:
        document.add("primitives", _array(primitives))
    behaviors = [_behavior(found, dissection, names) for found in dissection.behaviors if found.reached]
    behaviors += [_hold(held, dissection) for held in dissection.holds if held.holds]
    if behaviors:
        document.add("behaviors", _array(behaviors))
    return tomlkit.dumps(document)


def _header(dissection: Dissection, steered: set[str]) -> list[str]:
    lines = [
        f"Proposed by dissecting {dissection.policy_hash[:12]}… with preset '{dissection.preset.name}' and "
        f"seed {dissection.seed}: {dissection.rollouts} roll-outs.",
        "Effects are changes against the unperturbed roll-out, with 95 % intervals over starting states.",
    ]
    named = {attribute.name for attribute in dissection.attributes} & set(_PRIMITIVES)
    missing = sorted(named - steered)
    if missing:
        lines.append(f"No unit was confirmed for: {', '.join(missing)}.")
    for found in dissection.behaviors:
        if not found.reached:
            lines.append(
                f"Not found: {found.goal.name}. The best, {_describe(found.stimulation, dissection.layers)}, "
                f"gained enough on {found.success:.0%} of the held-out starts and fell on {found.falls:.0%}."
            )
    for held in dissection.holds:
        if not held.holds:
            lines.append(
                f"Not found: {_HOLDS[held.pid.attribute][0]}. The best controller is off by "
                f"{held.error:.2f}, without {held.uncontrolled:.2f}; it fell on {held.falls:.0%}."
            )
    return lines


def _describe(stimulation: Stimulation, layers: tuple[int, ...]) -> str:
    pairs = zip(stimulation.units, stimulation.values, strict=True)
    return ", ".join(f"{format_unit(unit, layers)} = {value:g}" for unit, value in pairs)


def _primitives(dissection: Dissection) -> list[dict[str, Any]]:
    entries: list[dict[str, Any]] = []
    for attribute, name in _PRIMITIVES.items():
        if attribute not in {one.name for one in dissection.attributes}:
            continue
        column = dissection.column(attribute)
        best = best_probed(column, dissection.screen, dissection.refined, dissection.seed)
        # Without a phase there is no ρ, and without ρ no magnitude c: such a unit is no primitive.
        rho = dissection.phase.circular[column]
        known = [one for one in best if one.confirmed and np.isfinite(rho[one.unit])]
        if known:
            entries.append(_primitive(name, attribute, column, known[0], dissection))
    return entries


def _primitive(
    name: str, attribute: str, column: int, best: Confirmation, dissection: Dissection
) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "name": name,
        "attribute": attribute,
        "unit": format_unit(best.unit, dissection.layers),
        "rho": round(float(dissection.phase.circular[column, best.unit]), 4),
    }
    discrepancy = float(dissection.matching.discrepancy[column, best.unit])
    if np.isfinite(discrepancy):
        entry["discrepancy"] = float(f"{discrepancy:.4g}")
    return entry | {"value": best.value, "measured": _measured(best.measured)}


def _behavior(found: Found, dissection: Dissection, names: dict[str, tuple[str, float]]) -> dict[str, Any]:
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
        "magnitudes": _inline(magnitudes),
        "aim": _inline({"attribute": goal.aim.attribute, "direction": goal.aim.direction}),
    }


def _hold(held: Held, dissection: Dissection) -> dict[str, Any]:
    name, key, says = _HOLDS[held.pid.attribute]
    pid = held.pid
    gains = {"kp": pid.kp, "ki": pid.ki, "kd": pid.kd, "limit": pid.limit, "step": pid.step}
    # By address even where a primitive has the unit: the controller was measured with these very weights.
    pairs = zip(held.weights.units, held.weights.values, strict=True)
    return {
        "name": name,
        "key": key,
        "says": says,
        "mode": "pid",
        "magnitudes": _inline({format_unit(unit, dissection.layers): weight for unit, weight in pairs}),
        "pid": _inline({"attribute": pid.attribute} | {k: float(f"{v:.4g}") for k, v in gains.items()}),
    }


def _measured(measured: Measured) -> Any:
    values = {"effect": measured.effect, "low": measured.low, "high": measured.high}
    return _inline({key: float(f"{value:.4g}") for key, value in values.items()})


def _inline(values: dict[str, Any]) -> Any:
    table = tomlkit.inline_table()
    table.update(values)
    return table


def _table(values: dict[str, Any]) -> Any:
    table = tomlkit.table()
    for key, value in values.items():
        table.add(key, value)
    return table


def _array(entries: list[dict[str, Any]]) -> Any:
    array = tomlkit.aot()
    for entry in entries:
        array.append(_table(entry))
    return array
