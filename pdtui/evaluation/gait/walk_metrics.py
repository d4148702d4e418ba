"""The figures of one walk of a robot, from the poses of its bodies and the contacts of its feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError
from pdtui.core.robot_links_and_state import Link
from pdtui.evaluation.gait.foot_metrics import (
    Contacts,
    FootMetrics,
    compute_foot_metrics,
    measure_alternation,
    measure_tilt,
    measure_walking_speed,
    time_share_by_feet_down,
)
from pdtui.evaluation.gait.quadruped_gaits import PLACES, PhaseLags, measure_phase_lags
from pdtui.evaluation.gait.sole_motion import find_soles, measure_sole_speeds
from pdtui.robots.geometry import root_body_row
from pdtui.robots.robot import Robot

CONTACT_HEIGHT = 0.01
"""Height over the lowest sole of a walk below which a foot is taken to stand, m, where nothing tells."""


@dataclass(frozen=True)
class WalkMetrics:
    """The figures of one walk.

    Attributes:
        seconds: How long it was measured, s.
        feet: Those of each foot.
        feet_down: Share of the time on 0, 1, … and all feet.
        alternation: Share of touchdowns that follow one of the other foot; NaN for other than two feet.
        lags: Phase lags of a quadruped's feet; None for other robots, or if a foot makes no stride.
        speed: Walking speed, m/s.
        tilt: Mean angle of the trunk to the vertical, rad.
    """

    seconds: float
    feet: tuple[FootMetrics, ...]
    feet_down: tuple[float, ...]
    alternation: float
    lags: PhaseLags | None
    speed: float
    tilt: float


def find_foot_links(robot: Robot) -> list[Link]:
    """Return the link of each foot.

    Raises:
        RobotError: The robot names no feet, or one with a link that it does not have.
    """
    if not robot.feet:
        raise RobotError(
            f"{robot.name}: expected a robot that says in `feet` which of its links it walks on, found none"
        )
    by_name = {link.name: link for link in robot.links}
    for foot in robot.feet:
        if foot.link not in by_name:
            raise RobotError(
                f"{robot.name}: foot '{foot.name}': no link '{foot.link}'; available: {', '.join(by_name)}"
            )
    return [by_name[foot.link] for foot in robot.feet]


def compute_walk_metrics(
    robot: Robot, links: Sequence[Link], poses: Floats, contacts: Contacts | None
) -> WalkMetrics:
    """Return the figures of a walk.

    Args:
        robot: The robot.
        links: The link of each foot.
        poses: Poses of all bodies at each control step, shape (T, B, 7).
        contacts: Whether each foot touches the ground, shape (T, F); None estimates it from the height.
    """
    dt, trunk = robot.control_dt, poses[:, root_body_row(robot.links)]
    soles = find_soles(links, poses)
    heights, speeds = soles[..., 2], measure_sole_speeds(links, poses, soles, dt)
    if contacts is None:
        contacts = heights < heights.min() + CONTACT_HEIGHT
    columns = range(len(links))
    places = [foot.place for foot in robot.feet]
    lags = None
    if sorted(places) == sorted(PLACES):
        ordered = [places.index(place) for place in PLACES]
        lags = measure_phase_lags(contacts[:, ordered])
    return WalkMetrics(
        len(poses) * dt,
        tuple(compute_foot_metrics(contacts[:, one], heights[:, one], speeds[:, one], dt) for one in columns),
        tuple(time_share_by_feet_down(contacts).tolist()),
        measure_alternation(contacts) if len(links) == 2 else float("nan"),
        lags,
        measure_walking_speed(trunk[:, :2], dt),
        measure_tilt(trunk[:, 3:]),
    )
