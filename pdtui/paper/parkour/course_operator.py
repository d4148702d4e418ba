"""A program that operates the keys on a parkour course: it sees late, and presses no faster than a person."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pdtui.paper.operator_behaviors import find_operator_behaviors
from pdtui.robots.parkour.parkour_course import SENSOR_DISTANCE, ObstacleKind, ParkourObstacle
from pdtui.stimulation.stimulation_map import StimulationMap

REACTION_TIME = 0.3
"""Age of what it sees when it acts, s."""
PRESSES_PER_SECOND = 3
"""Largest number of key presses in any second."""
DEFAULT = "default"
NEEDED_BEHAVIORS = ("stop", "hurry", "sidestep left", "sidestep right", "duck")
_STEPS_PER_DECISION = 5
_STEPS_OBSERVED = 24
"""Control steps over which it estimates the robot's velocity: about a cycle of the swaying gait."""


@dataclass(frozen=True)
class CourseOperatorSettings:
    """When it presses keys; tuned on courses of seeds from 1000 on.

    Attributes:
        duck_distance: distance to a bar at which it makes the robot duck, m.
        clear_of_bar: distance behind a bar at which it lets the robot stand up, m.
        hurry_distance: distance to the sensor of a door that closes at which it makes the robot hurry, m.
        stop_distance: distance to a closed door at which it stops the robot, m.
        begin_sidestep, end_sidestep: distance aside from the middle of a gate's opening at which it begins
            and ends a sidestep, m.
        glide: time for which the robot goes on aside as it did once it is let go, s.
        farthest_aside: distance from the middle of the lane from which it brings the robot back, m, as long
            as what the next obstacle asks for is farther away than `recentering_room`, m.
    """

    duck_distance: float = 0.95
    clear_of_bar: float = 0.25
    hurry_distance: float = 1.0
    stop_distance: float = 1.3
    begin_sidestep: float = 0.35
    end_sidestep: float = 0.15
    glide: float = 0.7
    farthest_aside: float = 1.2
    recentering_room: float = 0.6


@dataclass(frozen=True)
class CourseView:
    """What it sees in one control step: where the robot is, and the next obstacle.

    Attributes:
        x, y: place of the trunk, m.
        obstacle: the first obstacle that was not passed; None at the end of the course.
        closed: whether that obstacle is in the way; false for an open door.
        attempt: number of the attempt.
    """

    x: float
    y: float
    obstacle: ParkourObstacle | None
    closed: bool
    attempt: int


class CourseOperator:
    """Decides which key to press from what it saw `REACTION_TIME` ago and its own presses since then.

    Nothing is random: the same views give the same key presses.

    Args:
        stimulation_map: map of the robot.
        dt: duration of a control step, s.
        settings: when it presses keys.

    Raises:
        MapError: the map lacks a behavior that it needs.
    """

    def __init__(
        self,
        stimulation_map: StimulationMap,
        dt: float,
        settings: CourseOperatorSettings = CourseOperatorSettings(),
    ) -> None:
        behaviors = find_operator_behaviors(stimulation_map, NEEDED_BEHAVIORS)
        self._keys = {DEFAULT: stimulation_map.default_key} | {
            name: one.key for name, one in behaviors.items()
        }
        self._periods = {
            name: round(one.period / dt) for name, one in behaviors.items() if one.period is not None
        }
        self._dt, self._settings = dt, settings
        self._delay, self._second = math.ceil(REACTION_TIME / dt - 1e-9), math.ceil(1.0 / dt - 1e-9)
        self._views: list[CourseView] = []
        self._pressed: list[int] = []
        self._latched = DEFAULT

    def choose_key(self, view: CourseView) -> str:
        """Look at the present step and return the key to press before it; an empty string for none."""
        if self._views and view.attempt != self._views[-1].attempt:
            self._latched = DEFAULT  # a new attempt begins without behaviors
        self._views.append(view)
        step = len(self._views) - 1
        if self._latched in self._periods and step - self._pressed[-1] >= self._periods[self._latched]:
            self._latched = DEFAULT
        old = step - self._delay
        lately = self._pressed[-PRESSES_PER_SECOND:]
        rests = len(lately) == PRESSES_PER_SECOND and step - lately[0] < self._second
        if old < _STEPS_OBSERVED or step % _STEPS_PER_DECISION or rests:
            return ""
        seen, earlier = self._views[old], self._views[old - _STEPS_OBSERVED]
        if seen.attempt != view.attempt or earlier.attempt != view.attempt:
            return ""  # it does not know yet where the robot is now
        wanted = self._decide(seen, earlier)
        if wanted == self._latched:
            return ""
        self._latched = wanted
        self._pressed.append(step)
        return self._keys[wanted]

    def _decide(self, seen: CourseView, earlier: CourseView) -> str:
        """Return the behavior to latch, where the robot will be if it moves on as it did."""
        obstacle, settings = seen.obstacle, self._settings
        seconds = _STEPS_OBSERVED * self._dt
        vx, vy = (seen.x - earlier.x) / seconds, (seen.y - earlier.y) / seconds
        x, y = seen.x + REACTION_TIME * vx, seen.y + (REACTION_TIME + settings.glide) * vy
        distance = math.inf if obstacle is None else obstacle.place - x
        far = abs(y) > settings.farthest_aside or self._steps_aside
        if obstacle is None:
            return DEFAULT
        if far and distance > self._action_distance(obstacle.kind) + settings.recentering_room:
            return self._go_aside(-y)
        match obstacle.kind:
            case "gate":
                return self._go_aside(obstacle.opening - y)
            case "bar":
                under = -settings.clear_of_bar < distance < settings.duck_distance
                return "duck" if under else DEFAULT
            case "closing door":
                return "hurry" if distance < SENSOR_DISTANCE + settings.hurry_distance else DEFAULT
            case "opening door":
                return "stop" if seen.closed and distance < settings.stop_distance else DEFAULT

    def _action_distance(self, kind: ObstacleKind) -> float:
        """Return the distance to an obstacle at which it does something about it, m."""
        settings = self._settings
        distances: dict[ObstacleKind, float] = {
            "gate": math.inf,
            "bar": settings.duck_distance,
            "closing door": SENSOR_DISTANCE + settings.hurry_distance,
            "opening door": settings.stop_distance,
        }
        return distances[kind]

    @property
    def _steps_aside(self) -> bool:
        return self._latched in ("sidestep left", "sidestep right")

    def _go_aside(self, aside: float) -> str:
        """Return the sidestep that leads so far to the left, m, or none for little."""
        settings = self._settings
        if self._steps_aside:
            to_left = self._latched == "sidestep left"
            if (aside if to_left else -aside) > settings.end_sidestep:
                return self._latched
        if abs(aside) < settings.begin_sidestep:
            return DEFAULT
        return "sidestep left" if aside > 0 else "sidestep right"
