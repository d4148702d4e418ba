"""An operator that is a program: it sees the trees, reacts late, and presses no faster than a person."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import MapError
from pdtui.paper.forest.key_motion_model import (
    LOOKS_BACK,
    KeyMotionModel,
    RobotMotion,
    estimate_motion,
    predict_motion,
)
from pdtui.paper.forest.key_planner import KeyPlanner
from pdtui.paper.forest.tree_contact_recovery import WATCHED, TreeContactRecovery
from pdtui.stimulation.stimulation_map import StimulationMap

REACTION = 0.3
"""What it sees is at least this old when it acts, s."""
PRESSES = 3
"""At most so many key presses in any second."""
DEFAULT = "default"
WANTED = ("left", "right", "stop")
"""Behaviors that it needs; it takes ``forward``, too, where a map has it."""
_THINKS_EVERY = 5


def operator_keys(stimulation_map: StimulationMap) -> dict[str, str]:
    """The keys that it may press, by what they do; the default key comes first.

    Raises:
        MapError: the map lacks a behavior that it needs.
    """
    behaviors = stimulation_map.behaviors
    missing = [name for name in WANTED if name not in behaviors]
    if missing:
        known = ", ".join(behaviors) or "none"
        raise MapError(
            f"{stimulation_map.source}: the operator needs the behaviors {', '.join(WANTED)}; missing are "
            f"{', '.join(missing)}, there are {known}"
        )
    names = [*WANTED, *(["forward"] if "forward" in behaviors else [])]
    return {DEFAULT: stimulation_map.default_key} | {name: behaviors[name].key for name in names}


class ScriptedOperator:
    """Decides which key to press from what it saw `REACTION` ago and from its own presses since.

    It predicts where the robot is now and where each of a few hundred key schedules would lead
    (`KeyPlanner`). A robot that is stuck at a tree is turned away first (`TreeContactRecovery`). Nothing is
    random: the same observations give the same key presses.

    Args:
        responses: what each key does, by name, the default first.
        trees: x, y and radius, m, shape (N, 3).
        dt: s per control step.
        periods: control steps after which a behavior ends by itself, by name.
    """

    def __init__(
        self,
        responses: Mapping[str, KeyMotionModel],
        trees: Floats,
        dt: float,
        periods: Mapping[str, int] | None = None,
    ) -> None:
        self._names, self._responses = tuple(responses), tuple(responses.values())
        self._planner, self._escape = KeyPlanner(self._responses, trees), TreeContactRecovery(trees, dt)
        self._dt, self._periods = dt, dict(periods or {})
        self._delay = math.ceil(REACTION / dt - 1e-9)
        self._second = math.ceil(1.0 / dt - 1e-9)
        self._seen: list[tuple[float, float, float]] = []
        self._latched: list[int] = []
        self._pressed: list[int] = []

    def look(self, x: float, y: float, heading: float) -> str:
        """See where the robot is before the next control step, and say which key to press before it.

        Returns:
            Name of the key's behavior, ``default`` for the default key, or nothing.
        """
        step = len(self._seen)
        self._seen.append((x, y, heading))
        now = self._still_latched(step)
        choice = self._decide(step, now)
        self._latched.append(choice)
        if choice == now:
            return ""
        self._pressed.append(step)
        return self._names[choice]

    def _decide(self, step: int, now: int) -> int:
        old = step - self._delay
        if old < 1 or step % _THINKS_EVERY:
            return now
        if len(self._pressed) >= PRESSES and step - self._pressed[-PRESSES] < self._second:
            return now
        place = self._guess(old)
        lately = self._latched[max(0, old - round(WATCHED / self._dt)) : old]
        halted = self._names.index("stop") in lately
        turn = self._escape.turn(np.array(self._seen[: old + 1]), place.heading, halted)
        if turn:
            return self._names.index("left" if turn > 0 else "right")
        return self._planner.choose(place, now)

    def _guess(self, old: int) -> RobotMotion:
        """Where the robot is now, from how it moved up to step `old` and what was pressed since."""
        seen = estimate_motion(np.array(self._seen[max(0, old - LOOKS_BACK) : old + 1]), self._dt)
        return predict_motion(self._responses, seen, np.array([self._latched[old:]]), self._dt)[1]

    def _still_latched(self, step: int) -> int:
        if not self._latched:
            return 0
        latched = self._latched[-1]
        period = self._periods.get(self._names[latched])
        over = period is not None and step - self._pressed[-1] >= period
        return 0 if over else latched
