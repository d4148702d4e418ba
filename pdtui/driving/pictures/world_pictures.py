"""The pictures of a world without links during a drive: how often they are drawn, and which are kept."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections import deque

import numpy as np
from numpy.typing import NDArray

from pdtui.core.closable import Closable
from pdtui.core.errors import format_error_in_one_line
from pdtui.robots.robot import Robot

Picture = NDArray[np.uint8]
_PERIOD = 1 / 15  # shortest time between two pictures, s
_SHARE = 0.2  # of the time, that drawing may take
_KEPT = 600


class WorldPictures(Closable):
    """Draws the world of a robot without links, if it can be drawn, for at most a fifth of the time.

    The pictures are no part of the run, and are not recorded.

    Args:
        robot: the robot.

    Attributes:
        available: whether the world can be drawn.
        notice: why it cannot, where that is not plain; the user should read it.
    """

    def __init__(self, robot: Robot) -> None:
        self.available, self.notice = False, ""
        self._due = 0.0
        self._moments: deque[int] = deque(maxlen=_KEPT)
        self._pictures: deque[Picture] = deque(maxlen=_KEPT)
        self._twin = None
        if robot.links:
            return
        from pdtui.robots.environments.environment_twin import EnvironmentTwin
        from pdtui.robots.environments.plain_gymnasium_robot import PlainGymnasiumRobot

        if not isinstance(robot, PlainGymnasiumRobot) or not robot.offers_pictures:
            return
        try:
            self._twin = EnvironmentTwin(robot)
            self.available = self._twin.draw() is not None
        except Exception as error:  # whatever a third party's world raises
            self.notice = f"no picture: {format_error_in_one_line(error)}"

    def draw(self, moment: int, *, past: bool) -> Picture | None:
        """Return a picture of a moment, the present one or a `past` one; None where there is no new one."""
        if not self.available or self._twin is None:
            return None
        if past:
            row = bisect_right(self._moments, moment) - 1
            return self._pictures[row] if row >= 0 else None
        now = time.monotonic()
        if now < self._due:
            return None
        try:
            picture = self._twin.draw()
        except Exception:  # the drive goes on with the last picture
            self.available = False
            return None
        took = time.monotonic() - now
        self._due = now + max(_PERIOD, took / _SHARE)
        if picture is not None and (not self._moments or self._moments[-1] < moment):
            self._moments.append(moment)
            self._pictures.append(picture)
        return picture

    def close(self) -> None:
        """Close what draws."""
        if self._twin is not None:
            self._twin.close()
        self._twin, self.available = None, False
