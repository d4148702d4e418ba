"""What the PID of a behavior sets: commands, units, or interventions on them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

ControlInput = Literal["command", "units", "interventions", "both"]


def classify_pid_outputs(behavior: Behavior) -> ControlInput:
    """Return what the PID of a behavior sets."""
    kinds: dict[ControlInput, object] = {
        "command": behavior.commands,
        "units": behavior.magnitudes,
        "interventions": behavior.interventions,
    }
    used = [kind for kind, inputs in kinds.items() if inputs]
    return used[0] if len(used) == 1 else "both"


def list_pid_outputs(behavior: Behavior, stimulation_map: StimulationMap) -> tuple[str, ...]:
    """Return the names of the commands and units that it sets, and what its interventions change."""
    return (
        *behavior.commands,
        *stimulation_map.units_of(behavior),
        *(_describe_intervention(one, stimulation_map.vectors) for one in behavior.interventions),
    )


def _describe_intervention(one: Intervention, vectors: Mapping[str, LayerVectors]) -> str:
    """Return in a few words what an intervention changes."""
    match one.kind:
        case "direction" | "affine":
            count, layer = len(vectors[one.vectors].rows), vectors[one.vectors].layer
            number = "one" if count == 1 else str(count)
            return f"{number} direction{'s' if count > 1 else ''} of layer {layer}"
        case "imprint":
            return f"imprint of {' and '.join(dict.fromkeys((*one.values, *one.rates, *one.base)))}"
        case _:
            return ", ".join(one.values or one.ranges)
