"""The operator that shares control by keys (H*): it sees what the screen shows and presses few keys, late."""

from __future__ import annotations

import math

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.paper.driving.key_effects import ACCELERATE, BRAKE, DEFAULT, LEFT, RIGHT, KeyEffects
from pdtui.paper.driving.maneuver import (
    HORIZON,
    TIMES,
    Maneuver,
    TimesToConflict,
    distance_to_standing,
    drift,
    predict_times_to_conflict,
    roll,
    sideways_past_standing,
)
from pdtui.paper.driving.operator_memory import REACTION_TIME, JudgmentErrors, OperatorMemory
from pdtui.paper.driving.road_sight import RoadSight

PRESSES_PER_SECOND = 3
"""Largest number of key presses in any second."""
PATIENCE_STANDING, PATIENCE_MOVING, PATIENCE_EDGE = 3.4, 1.4, 2.0
"""Times before a conflict at which it acts: with what stands, with what moves, and with an edge, s."""
NEAR_STANDING = 20.0
"""Distance from something that stands in the way at which it acts although the car is slow, m."""
IMPROVEMENT, LAST_IMPROVEMENT = 1.0, 0.4
"""Time by which a lane change must postpone the next conflict, s: usually, and in the last moment."""
STOPPING_ROOM, CREEPING_ROOM = 18.0, 2.0
"""Distances from something that stands at which a fast and a slow car are to stop, m: to change lanes
afterwards, it needs room."""
_SLOW, _FAST = 4.0, 8.0
_SPEEDING_UP, _ROLLING = 2.0, 8.0
"""How a car is expected to start, m/s², and the speed up to which, m/s."""
_HALTED, _HALTED_TIME = 0.5, 2.0
"""Speed of a car that has halted, m/s, and the time after which it should have gone on, s."""
_CLOSE = 4.0
"""Distance from something that stands at which a halted car must first turn aside, m."""
_BRAKED_TIME = 3.0
"""Time after which it lets a stopped car go on unless somebody comes, s."""
_LANE_KEY_TIME = 1.2
"""Time after a lane key in which it does not brake early: what the key does is not to be seen yet, s."""
_PACE_TIME = 1.6
"""Time over which the car's speed matters for a lane change, s."""


class KeyOperator:
    """Decides which key to press, from what there is to see.

    Args:
        effects: What the keys do.
        dt: Duration of a control step, s.
        judgment: How it judges what it sees.
    """

    def __init__(self, effects: KeyEffects, dt: float, judgment: JudgmentErrors | None = None) -> None:
        self._effects, self._dt, self._judgment = effects, dt, judgment or JudgmentErrors()
        self._memory = OperatorMemory(dt, self._judgment)
        self._second = math.ceil(1.0 / dt - 1e-9)
        self._step, self._rolled = -1, 0
        self._presses: list[tuple[int, str]] = []

    def choose_key(self, sight: RoadSight) -> str:
        """Observe the road and return the task of the key to press now, or an empty string for none.

        ``default`` stands for the default key. Call it once per control step.
        """
        self._step += 1
        seen = self._memory.recall(sight)
        if seen is None:
            return ""
        if seen.speed > _HALTED:
            self._rolled = self._step
        if self._hand_is_busy():
            return ""
        key = self._choose(seen)
        if key:
            self._presses.append((self._step, key))
        return key

    def _hand_is_busy(self) -> bool:
        presses = self._presses[-PRESSES_PER_SECOND:]
        return len(presses) == PRESSES_PER_SECOND and self._step - presses[0][0] < self._second

    def _choose(self, seen: RoadSight) -> str:
        if self._latched() == BRAKE:
            return self._release(seen)
        if min((self._step - self._rolled) * self._dt, self._time_since(DEFAULT)) > _HALTED_TIME:
            return self._start_again(seen)
        go_on = Maneuver("", roll(seen.speed, 0.0), self._beside(seen))
        expected = predict_times_to_conflict(seen, go_on)
        if not self._must_act(seen, expected):
            return ""
        lanes, must_brake = self._lane_changes(seen), self._must_brake(seen, expected)
        # In the last moment, a small improvement is better than to lose the speed that a lane change needs.
        gain = LAST_IMPROVEMENT if must_brake else IMPROVEMENT
        better = [one for one in lanes if _improves(predict_times_to_conflict(seen, one), expected, gain)]
        if better:
            return max(better, key=lambda one: _preference(seen, one)).name
        if not must_brake:
            return ""
        if seen.speed < _SLOW and (aside := self._aside(seen)):
            return aside
        slower = Maneuver(BRAKE, roll(seen.speed, -self._effects.deceleration), drift(seen))
        return max((go_on, slower, *lanes), key=lambda one: predict_times_to_conflict(seen, one).first).name

    def _must_act(self, seen: RoadSight, expected: TimesToConflict) -> bool:
        patience = self._judgment.patience
        return (
            expected.standing < PATIENCE_STANDING * patience
            or expected.moving < PATIENCE_MOVING * patience
            or expected.edge < PATIENCE_EDGE * patience
            or distance_to_standing(seen) < NEAR_STANDING * patience
        )

    def _must_brake(self, seen: RoadSight, expected: TimesToConflict) -> bool:
        """Return whether the last moment to brake has come."""
        stopping = seen.speed**2 / (2 * self._effects.deceleration) + 0.2 * seen.speed
        room = float(np.interp(seen.speed, [_SLOW, _FAST], [CREEPING_ROOM, STOPPING_ROOM]))
        if self._time_since(LEFT, RIGHT) < _LANE_KEY_TIME:
            room = CREEPING_ROOM
        patience = self._judgment.patience
        return (
            distance_to_standing(seen) < stopping + room * patience
            or expected.moving < PATIENCE_MOVING * patience
            or expected.edge < PATIENCE_EDGE * patience
        )

    def _release(self, seen: RoadSight) -> str:
        """Return the default key once the car can go on, straight or with a lane change when it rolls."""
        straight = Maneuver(DEFAULT, roll(seen.speed, _SPEEDING_UP, _ROLLING), drift(seen))
        expected = predict_times_to_conflict(seen, straight)
        if math.isinf(expected.first):
            return DEFAULT
        waited = min((self._step - self._rolled) * self._dt, self._time_since()) > _BRAKED_TIME
        if math.isinf(expected.moving) and waited:
            return DEFAULT
        lanes = self._lane_changes(seen)
        better = (_improves(predict_times_to_conflict(seen, one), expected, IMPROVEMENT) for one in lanes)
        return DEFAULT if any(better) else ""

    def _aside(self, seen: RoadSight) -> str:
        """Return the key that moves a slow car past what stands in its way, on the side where less is to go.

        Nothing if a car is there, or while the key still works.
        """
        to_left, to_right = sideways_past_standing(seen)
        rolls = roll(seen.speed, 0.0)
        for distance, key in sorted([(to_left, LEFT), (to_right, RIGHT)]):
            shift = distance if key == LEFT else -distance
            shifted = Maneuver(key, rolls, np.full_like(TIMES, shift))
            conflicts = predict_times_to_conflict(seen, shifted)
            if math.isinf(conflicts.moving) and math.isinf(conflicts.edge):
                return key if self._may_press(key) else ""
        return ""

    def _may_press(self, key: str) -> bool:
        """Return whether a lane key may be pressed: again once it has ended, the other one once settled."""
        other = RIGHT if key == LEFT else LEFT
        pulse = self._effects.periods.get(key, self._effects.settling_time)
        return self._time_since(key) >= pulse and self._time_since(other) >= self._effects.settling_time

    def _lane_changes(self, seen: RoadSight) -> list[Maneuver]:
        """Return what the keys for lanes would do now; none while the last one is still at work."""
        rolls = roll(seen.speed, _SPEEDING_UP if seen.speed < _FAST else 0.0, _ROLLING)
        pace = float(np.interp(_PACE_TIME, TIMES, rolls)) / _PACE_TIME
        share = min(1.0, pace / self._effects.speed)
        return [
            Maneuver(key, rolls, drift(seen) + share * self._effects.moved(key, TIMES))
            for key in (LEFT, RIGHT)
            if self._may_press(key)
        ]

    def _beside(self, seen: RoadSight) -> Floats:
        """Return how far the car moves to the left by itself and by the lane key that was pressed last.

        A policy may steer against the key; once that is to be seen, the key counts no more.
        """
        key, since = (self._presses[-1][1], self._time_since()) if self._presses else ("", math.inf)
        works = since < 2 * REACTION_TIME or (seen.heading > 0.0) == (key == LEFT)
        if key in (LEFT, RIGHT) and since < self._effects.settling_time and works:
            return self._effects.moved(key, since + TIMES) - self._effects.moved(key, np.array([since]))
        return drift(seen)

    def _start_again(self, seen: RoadSight) -> str:
        """Return the key that gets a halted car going: first aside if something is close ahead."""
        if self._time_since() < _HALTED_TIME:
            return ""
        turned = bool(self._presses) and self._presses[-1][1] in (LEFT, RIGHT)
        if turned or distance_to_standing(seen) > _CLOSE:
            return ACCELERATE
        return self._aside(seen) or ACCELERATE

    def _time_since(self, *keys: str) -> float:
        """Return how long ago one of the keys was pressed, or any if none is named, s."""
        steps = [step for step, key in self._presses if not keys or key in keys]
        return (self._step - steps[-1]) * self._dt if steps else math.inf

    def _latched(self) -> str:
        if not self._presses:
            return ""
        step, key = self._presses[-1]
        period = self._effects.periods.get(key)
        over = period is not None and (self._step - step) * self._dt >= period
        return "" if over or key == DEFAULT else key


def _improves(conflicts: TimesToConflict, expected: TimesToConflict, gain: float) -> bool:
    """Return whether a lane change postpones the next conflict enough and stays on the road."""
    now = min(expected.first, HORIZON - gain)
    return conflicts.first > now + gain - 1e-9 and conflicts.edge > HORIZON / 2


def _preference(seen: RoadSight, change: Maneuver) -> tuple[float, float]:
    """Return how good a lane change is: late conflicts first, then room on its side."""
    return predict_times_to_conflict(seen, change).first, seen.left if change.name == LEFT else seen.right
