"""The course of a recorded drive: where the robot was and what its attributes were, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import Link
from pdtui.robots.geometry import rotate_vectors
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.streams.step_block import StepBlock
from pdtui.sessions.streams.step_block_reader import read_step_blocks

_ROWS = 10
"""Moments at which two courses are compared."""


@dataclass(frozen=True)
class DrivePath:
    """The course of a drive of S control steps, of which P have poses.

    Attributes:
        steps: numbers of the control steps, shape (S,).
        attributes: attributes after each, shape (S, J).
        pose_steps: those that have poses, shape (P,); none for a robot without links.
        places: the center of the robot's first shape after each of those, in m, shape (P, 3).
    """

    steps: NDArray[np.int64]
    attributes: Floats
    pose_steps: NDArray[np.int64]
    places: Floats


@dataclass(frozen=True)
class PathDifference:
    """Where two robots were after the same control step, x and y in m, and how far apart in m."""

    step: int
    first: tuple[float, float]
    second: tuple[float, float]
    apart: float


def read_drive_path(header: SessionHeader) -> DrivePath:
    """Read the course of a drive; a damaged or incomplete file is a `SessionError`."""
    steps, attributes, pose_steps, places = [], [], [np.empty(0, np.int64)], [np.empty((0, 3))]
    for block in read_step_blocks(header, poses=True):
        steps.append(block.steps)
        attributes.append(block.attributes)
        if len(block.pose_steps):
            pose_steps.append(block.pose_steps)
            places.append(_place_robot(header.info.links[0], block))
    return DrivePath(
        np.concatenate([np.empty(0, np.int64), *steps]),
        np.concatenate([np.empty((0, len(header.info.attributes))), *attributes]),
        np.concatenate(pose_steps),
        np.concatenate(places),
    )


def compare_drive_paths(a: DrivePath, b: DrivePath, start: int) -> tuple[PathDifference, ...]:
    """Compare where two robots were, at moments from step `start` to the last that both have."""
    shared, of_a, of_b = np.intersect1d(a.pose_steps, b.pose_steps, return_indices=True)
    later = np.flatnonzero(shared >= start)
    if not len(later):
        return ()
    chosen = later[np.unique(np.linspace(0, len(later) - 1, _ROWS).round().astype(int))]
    rows = []
    for index in chosen.tolist():
        one, other = a.places[of_a[index], :2], b.places[of_b[index], :2]
        apart = float(np.hypot(*(one - other)))
        rows.append(PathDifference(int(shared[index]), _pair(one), _pair(other), apart))
    return tuple(rows)


def _pair(place: Floats) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _place_robot(link: Link, block: StepBlock) -> Floats:
    """Return the center of the robot's first shape in each step that has poses, shape (p, 3)."""
    if link.shape == "box":
        return block.poses["Boxes3D:centers"][:, 0].astype(np.float64)
    # A session keeps where a capsule begins; from there, it extends along its own z.
    begins = block.poses["Capsules3D:translations"][:, 0].astype(np.float64)
    turns = block.poses["Capsules3D:quaternions"][:, 0].astype(np.float64)[:, [3, 0, 1, 2]]
    half = link.size[1] if link.shape == "capsule" else 0.0
    return begins + rotate_vectors(turns, np.array([0.0, 0.0, half]))
