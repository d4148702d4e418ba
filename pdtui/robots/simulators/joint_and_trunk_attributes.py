"""Attributes that many robots have: those of a trunk that moves freely, and the torques of joints."""

from __future__ import annotations

from collections.abc import Iterable

from pdtui.core.attributes import Attribute

TRUNK_ATTRIBUTES = (
    Attribute("vx", "m/s"),
    Attribute("vy", "m/s"),
    Attribute("speed", "m/s"),
    Attribute("yaw", "rad", wraps=True),
    Attribute("yaw rate", "rad/s"),
    Attribute("roll", "rad", wraps=True),
    Attribute("pitch", "rad"),
    Attribute("height", "m"),
)
"""What can be measured of a trunk that moves freely."""


def torque_attributes(joints: Iterable[str], limits: Iterable[float]) -> list[Attribute]:
    """Return the torque attributes of joints, scaled by their largest torques, N m."""
    names = (f"{joint} torque" for joint in joints)
    return [Attribute(name, "N m", 1.0 / limit) for name, limit in zip(names, limits, strict=True)]
