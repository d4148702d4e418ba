"""What a URDF file says of a robot's shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, cast
from xml.etree import ElementTree

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.robot_data import Link
from pdtui.robots.geometry import multiply_quaternions


def read_urdf_links(path: Path, bodies: Sequence[str]) -> tuple[Link, ...]:
    """The collision shapes of a robot; links on fixed joints belong to the body that they are fixed to.

    A cylinder is drawn as a capsule of the same radius and length.

    Args:
        path: of the file; only boxes, spheres and cylinders in it are drawn.
        bodies: names of the links that have a pose, in the order of the poses.
    """
    root = ElementTree.parse(path).getroot()
    fixed = {
        joint.find("child").attrib["link"]: joint  # type: ignore[union-attr]
        for joint in root.iter("joint")
        if joint.get("type") == "fixed"
    }
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
            drawn = _primitive(cast(Any, shape.find("geometry"))[0])
            if drawn is None:
                continue
            offset, turn = _origin(shape)
            place, quaternion = (cast(Any, tuple(values.tolist())) for values in (position + offset, turn))
            links.append(Link(name, bodies.index(carrier), *drawn, place, quaternion))
    return tuple(links)


def _primitive(
    geometry: ElementTree.Element,
) -> tuple[Literal["box", "sphere", "capsule"], tuple[float, ...]] | None:
    if geometry.tag == "box":
        return "box", tuple(float(side) / 2 for side in geometry.attrib["size"].split())
    if geometry.tag == "sphere":
        return "sphere", (float(geometry.attrib["radius"]),)
    if geometry.tag == "cylinder":
        radius, length = float(geometry.attrib["radius"]), float(geometry.attrib["length"])
        return "capsule", (radius, max(0.0, length / 2 - radius))
    return None


def _origin(element: ElementTree.Element) -> tuple[Floats, Floats]:
    """Place, and rotation as a quaternion, of an element's ``origin``."""
    origin = element.find("origin")
    given = {} if origin is None else origin.attrib
    position = np.array([float(value) for value in given.get("xyz", "0 0 0").split()])
    roll, pitch, yaw = (float(value) / 2 for value in given.get("rpy", "0 0 0").split())
    turn = np.array([math.cos(yaw), 0.0, 0.0, math.sin(yaw)])
    turn = multiply_quaternions(turn, np.array([math.cos(pitch), 0.0, math.sin(pitch), 0.0]))
    return position, multiply_quaternions(turn, np.array([math.cos(roll), math.sin(roll), 0.0, 0.0]))
