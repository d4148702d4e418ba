"""A program that operates the keys: it sees what a person sees, reacts late, and presses no faster."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pdtui.core.attributes import Floats, wrap_angle
from pdtui.paper.forest.key_motion_model import (
    STEPS_OBSERVED,
    KeyMotionModel,
    RobotMotion,
    estimate_motion,
    predict_motion,
)
from pdtui.paper.forest.key_planner import KeyPlanner
from pdtui.paper.operator_behaviors import find_operator_behaviors
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

REACTION_TIME = 0.3
"""Age of what it sees when it acts, at least, s."""
PRESSES_PER_SECOND = 3
"""Largest number of key presses in any second."""
DEFAULT = "default"
NEEDED_TASKS = ("left", "right", "stop")
"""Tasks for which it needs behaviors, whatever their names; it also uses one for ``forward``."""
_STEPS_PER_DECISION = 5
STUCK_TIME = 0.5
"""Time without progress after which the robot counts as stuck, s."""
_NO_PROGRESS = 0.12
"""Farthest that a stuck robot moves in that time, m."""
_NEAR = 0.45
"""Farthest distance from the tree's surface at which it may hold the robot, m."""
_AHEAD = 1.2
"""Largest angle between the heading and a tree that is ahead, rad."""
_CLEAR_TURNED = 1.3
"""Angle between the heading and the tree from which the robot is free, rad."""
_PATIENCE = 1.6
"""Time after which the other direction is tried, s."""


def operator_keys(stimulation_map: StimulationMap) -> dict[str, str]:
    """Return the keys that the operator may press by task, the default key first.

    Raises:
        MapError: the map lacks a behavior for a task.
    """
    behaviors = operator_behaviors(stimulation_map)
    return {DEFAULT: stimulation_map.default_key} | {task: one.key for task, one in behaviors.items()}


def operator_behaviors(stimulation_map: StimulationMap) -> dict[str, Behavior]:
    """Return the behaviors that the operator uses by task; one without a task counts by its name.

    Raises:
        MapError: the map lacks a behavior for a task.
    """
    return find_operator_behaviors(stimulation_map, NEEDED_TASKS, ("forward",))


class ScriptedOperator:
    """Decides which key to press from what it saw `REACTION_TIME` ago and its own presses since then.

    It predicts where the robot is now and where each of a few hundred key schedules would lead
    (`KeyPlanner`). A robot that is stuck at a tree is turned away first (`StuckAtTreeSteering`). Nothing is
    random: the same observations give the same key presses.

    Args:
        key_models: model of each key by name, the default key first.
        dt: duration of a control step, s.
        periods: control steps after which a behavior ends by itself, by name.
    """

    def __init__(
        self, key_models: Mapping[str, KeyMotionModel], dt: float, periods: Mapping[str, int] | None = None
    ) -> None:
        self._names, self._key_models = tuple(key_models), tuple(key_models.values())
        self._planner, self._recovery = KeyPlanner(self._key_models), StuckAtTreeSteering(dt)
        self._dt, self._periods = dt, dict(periods or {})
        self._delay = math.ceil(REACTION_TIME / dt - 1e-9)
        self._second = math.ceil(1.0 / dt - 1e-9)
        self._seen: list[tuple[float, float, float]] = []
        self._trees: list[Floats] = []
        self._latched: list[int] = []
        self._pressed: list[int] = []

    def choose_key(self, x: float, y: float, heading: float, trees: Floats) -> str:
        """Observe where the robot is and which trees are in sight, and decide which key to press next.

        Trees are x, y and radius in m, shape (N, 3). The key is named by its behavior: ``default`` for the
        default key, an empty string for no key.
        """
        step = len(self._seen)
        self._seen.append((x, y, heading))
        self._trees.append(trees)
        now = self._still_latched(step)
        choice = self._decide(step, now)
        self._latched.append(choice)
        if choice == now:
            return ""
        self._pressed.append(step)
        return self._names[choice]

    def _decide(self, step: int, now: int) -> int:
        old = step - self._delay
        if old < 1 or step % _STEPS_PER_DECISION:
            return now
        presses = self._pressed[-PRESSES_PER_SECOND:]
        if len(presses) == PRESSES_PER_SECOND and step - presses[0] < self._second:
            return now
        place, trees = self._predict_now(old), self._trees[old]
        lately = self._latched[max(0, old - round(STUCK_TIME / self._dt)) : old]
        halted = self._names.index("stop") in lately
        turn = self._recovery.choose_turn(np.array(self._seen[: old + 1]), trees, place.heading, halted)
        if turn:
            return self._names.index("left" if turn > 0 else "right")
        return self._planner.choose(place, trees, now)

    def _predict_now(self, old: int) -> RobotMotion:
        """Predict the motion now, from the motion at step `old` and the keys since then."""
        seen = estimate_motion(np.array(self._seen[max(0, old - STEPS_OBSERVED) : old + 1]), self._dt)
        return predict_motion(self._key_models, seen, np.array([self._latched[old:]]), self._dt)[1]

    def _still_latched(self, step: int) -> int:
        if not self._latched:
            return 0
        latched = self._latched[-1]
        period = self._periods.get(self._names[latched])
        over = period is not None and step - self._pressed[-1] >= period
        return 0 if over else latched


class StuckAtTreeSteering:
    """Decides which way to turn while the robot is stuck at a tree, until the tree is beside it.

    A robot that cannot sense trees keeps walking against one, and a prediction without contacts expects it to
    pass. Turning frees it, on the spot if need be. Some directions do not work in some places, so that after
    a while the other direction is tried.
    """

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self._watched = round(STUCK_TIME / dt)
        self._side, self._since = 0, 0.0

    def choose_turn(self, seen: Floats, trees: Floats, heading: float, halted: bool) -> int:
        """Return which way to turn now: 1 left, −1 right, 0 if the robot is not stuck.

        The places seen so far are x, y and heading, shape (S, 3), and the trees in sight x, y and radius,
        shape (N, 3); the heading is the one predicted for now, in rad; the robot is halted if a key latched
        lately made it stand still.
        """
        x, y, saw = seen[-1].tolist()
        time = len(seen) * self._dt
        away = np.hypot(trees[:, 0] - x, trees[:, 1] - y) - trees[:, 2]
        nearest = int(np.argmin(away)) if len(away) else -1
        if nearest < 0 or away[nearest] > _NEAR:
            self._side = 0
            return 0
        to_tree = math.atan2(trees[nearest, 1] - y, trees[nearest, 0] - x)
        if self._side:
            if abs(wrap_angle(to_tree - heading)) > _CLEAR_TURNED:
                self._side = 0
            elif time - self._since > _PATIENCE:
                self._side, self._since = -self._side, time
            return self._side
        moved = np.hypot(*(seen[-1, :2] - seen[max(0, len(seen) - 1 - self._watched), :2]))
        before = abs(wrap_angle(to_tree - saw)) < _AHEAD
        if halted or len(seen) <= self._watched or moved > _NO_PROGRESS or not before:
            return 0
        self._side, self._since = self._better_direction(to_tree, heading), time
        return self._side

    @staticmethod
    def _better_direction(to_tree: float, heading: float) -> int:
        """Return the direction that clears the tree sooner and leaves the heading nearer to +x."""
        left, right = wrap_angle(to_tree + _CLEAR_TURNED), wrap_angle(to_tree - _CLEAR_TURNED)
        costs = [abs(wrap_angle(aim - heading)) + abs(aim) for aim in (left, right)]
        return 1 if costs[0] <= costs[1] else -1
