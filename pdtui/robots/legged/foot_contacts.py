"""Whether the feet of a robot touch the ground, by its attributes or by MuJoCo's contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pdtui.core.robot_links_and_state import Foot
    from pdtui.robots.robot import Robot


def read_contact_attributes(robot: Robot) -> list[bool] | None:
    """Return whether the contact attribute of each foot is above 0; None if a foot has none.

    Raises:
        RobotError: A foot names an attribute that the robot does not have.
    """
    if not robot.feet or not all(foot.contact for foot in robot.feet):
        return None
    values = robot.read_attributes()
    return [bool(values[robot.attribute_index(foot.contact)] > 0.0) for foot in robot.feet]


def read_mujoco_contacts(model: Any, data: Any, feet: Sequence[Foot]) -> list[bool]:
    """Return whether each foot is pushed by something that stands still, in the last physics step.

    Args:
        model, data: MuJoCo's model and data.
        feet: The feet; the link of each is a geom of that name.

    Raises:
        KeyError: The model has no geom of that name.
    """
    import mujoco

    force, standing = np.zeros(6), set()
    for number, contact in enumerate(data.contact[: data.ncon]):
        one, other = contact.geom.tolist()
        still = [bool(model.body_weldid[model.geom_bodyid[geom]] == 0) for geom in (one, other)]
        if still[0] == still[1]:
            continue
        mujoco.mj_contactForce(model, data, number, force)
        if force[0] > 0.0:
            standing.add(other if still[0] else one)
    return [model.geom(foot.link).id in standing for foot in feet]
