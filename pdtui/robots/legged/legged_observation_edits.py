"""Edits of what a legged robot with commands observes; `compute_legged_observations` has the order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.robots.legged.legged_robot_description import HeightScan, LeggedRobotDescription
from pdtui.robots.legged.observations_and_rewards import (
    ANGULAR_SCALE,
    COMMAND_SCALES,
    LINEAR_SCALE,
    MAX_SCANNED,
)
from pdtui.robots.observation_edits.observation_edit import (
    ObservationEdit,
    offset_observed_number,
    scale_observed_number,
    set_observed_number,
)

_GRAVITY = slice(7, 10)
_FIRST_COMMAND = 10
_OBSERVED_COMMANDS = ("forward", "lateral", "yaw rate")

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


def _roll_trunk(observation: Floats, angle: float) -> Floats:
    edited, (c, s) = observation.copy(), (math.cos(angle), math.sin(angle))
    x, y, z = observation[_GRAVITY].tolist()
    edited[_GRAVITY] = x, c * y + s * z, c * z - s * y
    return edited


def _pitch_trunk(observation: Floats, angle: float) -> Floats:
    edited, (c, s) = observation.copy(), (math.cos(angle), math.sin(angle))
    x, y, z = observation[_GRAVITY].tolist()
    edited[_GRAVITY] = c * x - s * z, y, c * z + s * x
    return edited


BALANCE_EDITS = (
    scale_observed_number(1, "forward gain", "its forward speed is larger by this share of it"),
    scale_observed_number(2, "sideways gain", "its speed to the left is larger by this share of it"),
    offset_observed_number(3, "upward offset", "m/s", "it moves up faster by this much", LINEAR_SCALE),
    ObservationEdit("roll offset", "rad", "the trunk leans to the right by this much", _roll_trunk),
    ObservationEdit("pitch offset", "rad", "the trunk leans forward by this much", _pitch_trunk),
)


def legged_observation_edits(
    description: LeggedRobotDescription, joints: Sequence[str]
) -> tuple[ObservationEdit, ...]:
    """Return the edits of what a policy of a robot observes of its trunk, its commands and its joints.

    Args:
        description: The robot.
        joints: Names of its joints, in their order.
    """
    height = (
        TRUNK_EDITS[0] if description.scan is None else _scanned_height_edit(description, description.scan)
    )
    commands = _OBSERVED_COMMANDS[: description.observed_commands]
    further = [*BALANCE_EDITS, *_command_offset_edits(commands), *_joint_edits(description, joints)]
    if description.scan is not None:
        further.append(_ground_edit(description, description.scan))
    helping = (replace(one, dissected=False) for one in further)
    return (height, *TRUNK_EDITS[1:], *command_edits(commands), *helping)


def _command_offset_edits(commands: Iterable[str]) -> Iterable[ObservationEdit]:
    for index, (name, scale) in enumerate(zip(commands, COMMAND_SCALES.tolist(), strict=False)):
        says = f"its {name} command is larger by this much"
        yield offset_observed_number(
            _FIRST_COMMAND + index, f"{name} command offset", _command_unit(name), says, float(scale)
        )


def _command_unit(name: str) -> str:
    return "rad/s" if name == "yaw rate" else "m/s"


def _joint_edits(description: LeggedRobotDescription, joints: Sequence[str]) -> Iterable[ObservationEdit]:
    first = _FIRST_COMMAND + description.observed_commands
    for index, joint in enumerate(joints):
        says = "its angle is larger by this much"
        yield offset_observed_number(first + index, f"{joint} offset", "rad", says)


def _scanned_height_edit(description: LeggedRobotDescription, scan: HeightScan) -> ObservationEdit:
    """Return the edit "height offset" where the distance to points of the ground is observed as well."""
    lower_ground, plain = _ground_edit(description, scan), TRUNK_EDITS[0]
    return replace(
        plain, apply=lambda observation, offset: lower_ground.apply(plain.apply(observation, offset), offset)
    )


def _ground_edit(description: LeggedRobotDescription, scan: HeightScan) -> ObservationEdit:
    first, largest = description.observations - scan.count**2, scan.scale * MAX_SCANNED

    def lower(observation: Floats, offset: float) -> Floats:
        edited = observation.copy()
        edited[first:] = np.clip(edited[first:] + scan.scale * offset, -largest, largest)
        return edited

    return ObservationEdit("ground offset", "m", "the scanned ground is lower by this much", lower)


def command_edits(commands: Iterable[str]) -> tuple[ObservationEdit, ...]:
    """Return the edits that set what a policy observes of its commands, in their order."""
    return tuple(
        set_observed_number(
            _FIRST_COMMAND + index,
            f"{name} command",
            _command_unit(name),
            f"its {name} command has this value",
            float(COMMAND_SCALES[index]),
        )
        for index, name in enumerate(commands)
    )
