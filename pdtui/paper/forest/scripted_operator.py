"""A program that operates the keys: it sees the trees, reacts late, and presses no faster than a person."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import MapError
from pdtui.paper.forest.key_motion_model import (
    STEPS_OBSERVED,
    KeyMotionModel,
    RobotMotion,
    estimate_motion,
    predict_motion,
)
from pdtui.paper.forest.key_planner import KeyPlanner
from pdtui.paper.forest.tree_contact_recovery import STUCK_TIME, TreeContactRecovery
from pdtui.stimulation.stimulation_map import StimulationMap

REACTION_TIME = 0.3
"""Age of what it sees when it acts, at least, s."""
PRESSES_PER_SECOND = 3
"""Largest number of key presses in any second."""
DEFAULT = "default"
NEEDED_BEHAVIORS = ("left", "right", "stop")
"""Behaviors that it needs; it also uses ``forward`` if the map has it."""
_STEPS_PER_DECISION = 5


def operator_keys(stimulation_map: StimulationMap) -> dict[str, str]:
    """Return the keys that the operator may press by behavior, the default key first.

    Raises:
        MapError: the map lacks a behavior that it needs.
    """
    behaviors = stimulation_map.behaviors
    missing = [name for name in NEEDED_BEHAVIORS if name not in behaviors]
    if missing:
        known = ", ".join(behaviors) or "none"
        raise MapError(
            f"{stimulation_map.source}: the operator needs the behaviors {', '.join(NEEDED_BEHAVIORS)}; "
            f"missing are {', '.join(missing)}, there are {known}"
        )
    names = [*NEEDED_BEHAVIORS, *(["forward"] if "forward" in behaviors else [])]
    return {DEFAULT: stimulation_map.default_key} | {name: behaviors[name].key for name in names}


class ScriptedOperator:
    """Decides which key to press from what it saw `REACTION_TIME` ago and its own presses since then.

    It predicts where the robot is now and where each of a few hundred key schedules would lead
    (`KeyPlanner`). A robot that is stuck at a tree is turned away first (`TreeContactRecovery`). Nothing is
    random: the same observations give the same key presses.

    Args:
        key_models: model of each key by name, the default key first.
        trees: x, y and radius of the trees, m, shape (N, 3).
        dt: duration of a control step, s.
        periods: control steps after which a behavior ends by itself, by name.
    """

    def __init__(
        self,
        key_models: Mapping[str, KeyMotionModel],
        trees: Floats,
        dt: float,
        periods: Mapping[str, int] | None = None,
    ) -> None:
        self._names, self._key_models = tuple(key_models), tuple(key_models.values())
        self._planner, self._recovery = KeyPlanner(self._key_models, trees), TreeContactRecovery(trees, dt)
        self._dt, self._periods = dt, dict(periods or {})
        self._delay = math.ceil(REACTION_TIME / dt - 1e-9)
        self._second = math.ceil(1.0 / dt - 1e-9)
        self._seen: list[tuple[float, float, float]] = []
        self._latched: list[int] = []
        self._pressed: list[int] = []

    def choose_key(self, x: float, y: float, heading: float) -> str:
        """Observe where the robot is, and decide which key to press before the next control step.

        Returns:
            Name of the key's behavior, ``default`` for the default key, or an empty string.
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
        if old < 1 or step % _STEPS_PER_DECISION:
            return now
        if (
            len(self._pressed) >= PRESSES_PER_SECOND
            and step - self._pressed[-PRESSES_PER_SECOND] < self._second
        ):
            return now
        place = self._predict_now(old)
        lately = self._latched[max(0, old - round(STUCK_TIME / self._dt)) : old]
        halted = self._names.index("stop") in lately
        turn = self._recovery.choose_turn(np.array(self._seen[: old + 1]), place.heading, halted)
        if turn:
            return self._names.index("left" if turn > 0 else "right")
        return self._planner.choose(place, now)

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
