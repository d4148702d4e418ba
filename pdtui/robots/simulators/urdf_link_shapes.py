"""A robot's shapes, read from a URDF file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast
from xml.etree import ElementTree

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.robots.geometry import multiply_quaternions


def read_urdf_link_shapes(path: Path, bodies: Sequence[str]) -> tuple[Link, ...]:
    """Return the boxes, spheres and cylinders among the collision shapes of a robot.

    A link on a fixed joint belongs to the body that it is fixed to. A cylinder becomes a capsule of the same
    radius and length.

    Args:
        path: The file.
        bodies: Names of the links that have a pose, in the order of the poses.
    """
    root = ElementTree.parse(path).getroot()
    joints = root.iterfind(".//joint[@type='fixed']")
    fixed = {cast(Any, joint.find("child")).attrib["link"]: joint for joint in joints}
    links = []
    for link in root.iter("link"):
        name, position = link.attrib["name"], np.zeros(3)
        carrier = name
        while carrier in fixed:
            joint = fixed[carrier]
            position = position + _origin(joint)[0]
            carrier = cast(Any, joint.find("parent")).attrib["link"]
        if carrier not in bodies:
            continue
        for shape in link.findall("collision"):
            primitive = _read_primitive(cast(Any, shape.find("geometry"))[0])
            if primitive is not None:
                offset, turn = _origin(shape)
                pose: Any = (tuple(values.tolist()) for values in (position + offset, turn))
                links.append(Link(name, bodies.index(carrier), *primitive, *pose))
    return tuple(links)


def _read_primitive(geometry: ElementTree.Element) -> tuple[Any, tuple[float, ...]] | None:
    if geometry.tag == "box":
        return "box", tuple(float(side) / 2 for side in geometry.attrib["size"].split())
    if geometry.tag == "sphere":
        return "sphere", (float(geometry.attrib["radius"]),)
    if geometry.tag == "cylinder":
        radius, length = float(geometry.attrib["radius"]), float(geometry.attrib["length"])
        return "capsule", (radius, max(0.0, length / 2 - radius))
    return None


def _origin(element: ElementTree.Element) -> tuple[Floats, Floats]:
    """Return the position of an element's ``origin``, and its rotation as a quaternion."""
    origin = element.find("origin")
    given = {} if origin is None else origin.attrib
    position = np.array([float(value) for value in given.get("xyz", "0 0 0").split()])
    roll, pitch, yaw = (float(value) / 2 for value in given.get("rpy", "0 0 0").split())
    turn = np.array([math.cos(yaw), 0.0, 0.0, math.sin(yaw)])
    turn = multiply_quaternions(turn, np.array([math.cos(pitch), 0.0, math.sin(pitch), 0.0]))
    return position, multiply_quaternions(turn, np.array([math.cos(roll), math.sin(roll), 0.0, 0.0]))
