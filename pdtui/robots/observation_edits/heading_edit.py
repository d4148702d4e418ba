"""Edits of the heading in an observation: "heading" sets it and "heading offset" adds to it, both in rad.

The velocity in the world turns with the trunk, so that the robot seems to do the same in another direction.

A quaternion and its negative are the same heading, and not the same observation: a robot that has turned once
round observes the negative of what it observed before. A policy that never did so in training falls at once.
An offset therefore counts whole turns: it makes the same observation again only after two of them. A robot
that always observes the canonical one of the two, whose w is not negative, needs no such count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.robots.geometry import roll_pitch_yaw
from pdtui.robots.observation_edits.observation_edit import ObservationEdit


def canonicalize_quaternion(observation: Floats, quaternion: int) -> None:
    """Negate the quaternion w x y z at an index of an observation if its w is negative, in place."""
    if observation[quaternion] < 0.0:
        observation[quaternion : quaternion + 4] *= -1.0


def quaternion_heading_edits(
    quaternion: int, velocity: int, *, canonical: bool = False
) -> tuple[ObservationEdit, ObservationEdit]:
    """Return the edits "heading" and "heading offset" of an observation that holds the trunk's quaternion.

    Args:
        quaternion: Index in the observation of the trunk's quaternion w x y z.
        velocity: Index of its velocity x y in the world.
        canonical: Whether the robot observes the quaternion whose w is not negative, so that an edit makes
            such an observation, too, and whole turns make no difference.
    """

    def turn(observation: Floats, angle: float) -> Floats:
        edited = observation.copy()
        w, x, y, z = observation[quaternion : quaternion + 4].tolist()
        c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
        edited[quaternion : quaternion + 4] = (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)
        vx, vy = observation[velocity : velocity + 2].tolist()
        edited[velocity : velocity + 2] = _rotate(vx, vy, angle)
        if canonical:
            canonicalize_quaternion(edited, quaternion)
        return edited

    def face(observation: Floats, heading: float) -> Floats:
        *_, yaw = roll_pitch_yaw(*observation[quaternion : quaternion + 4].tolist())
        edited = turn(observation, heading - yaw)
        canonicalize_quaternion(edited, quaternion)  # however often the robot has turned
        return edited

    return _name_edits(face, turn, (2.0 if canonical else 4.0) * math.pi)


def yaw_heading_edits(
    yaws: Sequence[int], velocities: Sequence[int]
) -> tuple[ObservationEdit, ObservationEdit]:
    """Return the edits "heading" and "heading offset" of an observation that holds the trunk's yaw.

    Args:
        yaws: Indices in the observation of the yaw, now and in earlier steps; the first is the present one.
        velocities: Indices of the velocities x y in the world, or of displacements, now and earlier.
    """

    def turn(observation: Floats, angle: float) -> Floats:
        edited = observation.copy()
        for index in yaws:
            edited[index] = wrap_angle(float(observation[index]) + angle)
        for index in velocities:
            vx, vy = observation[index : index + 2].tolist()
            edited[index : index + 2] = _rotate(vx, vy, angle)
        return edited

    def face(observation: Floats, heading: float) -> Floats:
        return turn(observation, heading - float(observation[yaws[0]]))

    return _name_edits(face, turn, 2.0 * math.pi)


def displacement_edit(yaws: Sequence[int], displacements: Sequence[int], dt: float) -> ObservationEdit:
    """Return the edit "speed offset" of an observation that holds yaw and displacement of several steps.

    Args:
        yaws, displacements: Indices in the observation of each step's yaw, and of its displacement x y.
        dt: Duration of a step, s.
    """

    def move(observation: Floats, speed: float) -> Floats:
        edited = observation.copy()
        for yaw, index in zip(yaws, displacements, strict=True):
            x, y = _rotate(speed * dt, 0.0, float(observation[yaw]))
            edited[index] += x
            edited[index + 1] += y
        return edited

    return ObservationEdit("speed offset", "m/s", "it moves the way that it faces faster by this much", move)


def _rotate(x: float, y: float, angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y


def _name_edits(
    face: Callable[[Floats, float], Floats], turn: Callable[[Floats, float], Floats], period: float
) -> tuple[ObservationEdit, ObservationEdit]:
    return (
        ObservationEdit(
            "heading",
            "rad",
            "the torso, and its velocity with it, heads in this direction",
            face,
            2.0 * math.pi,
        ),
        ObservationEdit(
            "heading offset", "rad", "torso and velocity are turned to the left by this much", turn, period
        ),
    )
