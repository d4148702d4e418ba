"""Edits of what the A1 observes of its last 3 control steps; `A1` has the order."""

from __future__ import annotations

from pdtui.robots.observation_edits.heading_edit import displacement_edit, yaw_heading_edits
from pdtui.robots.observation_edits.observation_edit import ObservationEdit

_YAWS, _DISPLACEMENTS = (11, 15, 19), (0, 3, 6)


def a1_observation_edits(dt: float) -> tuple[ObservationEdit, ...]:
    """Return the edits of heading and speed, given the duration of a control step, s."""
    return *yaw_heading_edits(_YAWS, _DISPLACEMENTS), displacement_edit(_YAWS, _DISPLACEMENTS, dt)
