"""Edits of what a legged robot with commands observes; `compute_legged_observations` has the order."""

from __future__ import annotations

from collections.abc import Iterable

from pdtui.robots.legged.observations_and_rewards import ANGULAR_SCALE, COMMAND_SCALES, LINEAR_SCALE
from pdtui.robots.observation_edits.observation_edit import (
    ObservationEdit,
    offset_observed_number,
    set_observed_number,
)

_FIRST_COMMAND = 10

TRUNK_EDITS = (
    offset_observed_number(0, "height offset", "m", "the trunk is higher by this much"),
    offset_observed_number(1, "forward offset", "m/s", "it walks forward faster by this much", LINEAR_SCALE),
    offset_observed_number(
        2, "sideways offset", "m/s", "it moves faster to the left by this much", LINEAR_SCALE
    ),
    offset_observed_number(
        6, "yaw rate offset", "rad/s", "it turns faster to the left by this much", ANGULAR_SCALE
    ),
)


def command_edits(commands: Iterable[str]) -> tuple[ObservationEdit, ...]:
    """Return the edits that set what a policy observes of its commands, in their order."""
    return tuple(
        set_observed_number(
            _FIRST_COMMAND + index,
            f"{name} command",
            "rad/s" if name == "yaw rate" else "m/s",
            f"its {name} command has this value",
            float(COMMAND_SCALES[index]),
        )
        for index, name in enumerate(commands)
    )
