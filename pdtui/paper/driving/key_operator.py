"""The operator that shares control by keys (H*): it sees what the screen shows and presses few keys, late."""

from __future__ import annotations

import math

from pdtui.paper.driving.key_effects import ACCELERATE, BRAKE, DEFAULT, LEFT, RIGHT, KeyEffects
from pdtui.paper.driving.maneuver import (
    HORIZON,
    INWARDS,
    ROOM_FOR_CROSSING,
    WEAVING,
    Maneuver,
    TimesToConflict,
    next_standing,
    predict_times_to_conflict,
    slips_off,
)
from pdtui.paper.driving.maneuver_predictor import ManeuverPredictor
from pdtui.paper.driving.operator_memory import JudgmentErrors, OperatorMemory
from pdtui.paper.driving.road_sight import LANE_WIDTH, RoadSight

PRESSES_PER_SECOND = 3
"""Largest number of key presses in any second."""
PATIENCE_STANDING, PATIENCE_MOVING, PATIENCE_CROSSING, PATIENCE_EDGE = 4.0, 1.2, 3.2, 1.5
"""Times before a conflict at which it acts: with what stands, with who drives along the road, with who
crosses it, and with an edge, s."""
URGENT = 1.1
"""Time before a conflict at which it acts although it has just done something, s."""
LAST_MOMENT = 0.7
"""Time before a conflict with an edge at which it may brake, s."""
IMPROVEMENT = 1.0
"""Time by which a key must postpone the next conflict, s."""
STOPPING_ROOM = 9.0
"""Distance from something that stands at which the car is to stop, m: it needs room to pass it then."""
_SLOW = 2.0
"""Speed up to which a car turns back from an edge by itself, m/s."""
_HALTED, _HALTED_TIME = 0.5, 2.0
"""Speed of a car that has halted, m/s, and the time after which it should have gone on, s."""
_NEAR_ENOUGH, _TOO_FAR = 0.3, 0.8
"""How far from the middle of a lane a lane change may end, before it and beyond it, m."""
_ASKEW = 0.3
"""Angle to the road up to which a lane key may turn the car, rad."""
_SIDEWAYS_ACCELERATION, _BEND_AHEAD = 5.5, (2.0, 5.0, 8.0)
"""Acceleration to the side in a bend above which it brakes, m/s², and where it looks for one, m ahead."""
_SETTLING = 0.6
"""Time after a lane key in which the car settles in its lane, s."""
_BRAKE_TIME, _BRAKED_TIME = 0.5, 4.0
"""Time for which it brakes at least, and after which it lets a stopped car go on unless somebody comes, s."""
_DOUBT = 0.4
"""How much faster or slower somebody who crosses the road may turn than seen, rad/s."""


class KeyOperator:
    """Decides which key to press, from what there is to see.

    Args:
        effects: What the keys do.
        dt: Duration of a control step, s.
        judgment: How it judges what it sees.
    """

    def __init__(self, effects: KeyEffects, dt: float, judgment: JudgmentErrors | None = None) -> None:
        self._dt, self._patience = dt, (judgment or JudgmentErrors()).patience
        self._memory = OperatorMemory(dt, judgment or JudgmentErrors())
        self._keys = ManeuverPredictor(effects, dt)
        self._second = math.ceil(1.0 / dt - 1e-9)
        self._rolled, self._aim, self._askew = 0, 0.0, _ASKEW

    def choose_key(self, sight: RoadSight) -> str:
        """Observe the road and return the task of the key to press now, or an empty string for none.

        ``default`` stands for the default key. Call it once per control step.
        """
        self._keys.step += 1
        seen = self._memory.recall(sight)
        if seen is None:
            return ""
        if seen.speed > _HALTED:
            self._rolled = self._keys.step
        if self._hand_is_busy():
            return ""
        key = self._choose(self._keys.predict_sight(seen))
        if key:
            self._keys.press(key)
        return key

    def _hand_is_busy(self) -> bool:
        presses = self._keys.presses[-PRESSES_PER_SECOND:]
        return len(presses) == PRESSES_PER_SECOND and self._keys.step - presses[0][0] < self._second

    def _choose(self, seen: RoadSight) -> str:
        latched, _ = self._keys.find_active_key()
        if latched == BRAKE:
            return self._release(seen)
        if min(self._halted_time(), self._keys.time_since(DEFAULT)) > _HALTED_TIME:
            return self._start_again(seen)
        go_on = self._keys.go_on(seen)
        if latched in (LEFT, RIGHT) and self._is_done(seen, latched, go_on):
            return DEFAULT
        if (key := {1: RIGHT, -1: LEFT}.get(slips_off(seen), latched)) != latched:
            return self._steer(seen, key, seen.lane)
        if not latched and (key := self._aside(seen)):
            return key
        if seen.speed**2 * max(abs(seen.bend(ahead)) for ahead in _BEND_AHEAD) > _SIDEWAYS_ACCELERATION:
            return BRAKE
        expected = predict_times_to_conflict(seen, go_on, ROOM_FOR_CROSSING)
        if not self._must_act(seen, expected):
            return ""
        outlooks = [(predict_times_to_conflict(seen, one), one) for one in self._options(seen, expected)]
        good = [pair for pair in outlooks if _improves(pair[0], expected)]
        if not good:
            return ""
        key = max(good, key=lambda pair: _preference(seen, *pair))[1].name
        if key not in (LEFT, RIGHT):
            return key
        away = expected.edge == expected.first
        lane = seen.lane if away else seen.lane + (1 if key == LEFT else -1)
        return self._steer(seen, key, min(max(lane, 0), seen.lanes - 1))

    def _options(self, seen: RoadSight, expected: TimesToConflict) -> list[Maneuver]:
        """Return what may be done: keys for lanes, where nobody crosses the road, and in time the brake."""
        options = []
        if self._keys.find_active_key()[0] in (LEFT, RIGHT):
            options.append(self._keys.let_go(seen))
        if expected.crossing > expected.first:
            options += self._keys.lane_changes(seen)
        if self._must_brake(seen, expected):
            options.append(self._keys.brake(seen))
        return options

    def _must_act(self, seen: RoadSight, expected: TimesToConflict) -> bool:
        edge = expected.edge if abs(seen.heading) > WEAVING else math.inf
        others = min(expected.standing, expected.moving, expected.crossing)
        if min(others, edge) < URGENT:
            return True
        if self._keys.time_since(LEFT, RIGHT) < self._keys.longest_lane_pulse() + _SETTLING:
            return False
        return (
            expected.standing < PATIENCE_STANDING * self._patience
            or expected.moving < PATIENCE_MOVING * self._patience
            or expected.crossing < PATIENCE_CROSSING * self._patience
            or edge < PATIENCE_EDGE * self._patience
        )

    def _must_brake(self, seen: RoadSight, expected: TimesToConflict) -> bool:
        """Return whether the last moment to brake has come."""
        room = self._keys.stopping_distance(seen.speed) + 0.2 * seen.speed + STOPPING_ROOM * self._patience
        stands = math.isfinite(expected.standing) and next_standing(seen)[0] < room
        slips = expected.edge < LAST_MOMENT * self._patience and abs(seen.heading) > WEAVING
        return (
            ((stands or slips) and seen.speed > _SLOW)
            or expected.moving < PATIENCE_MOVING * self._patience
            or expected.crossing < PATIENCE_CROSSING * self._patience
        )

    def _is_done(self, seen: RoadSight, key: str, go_on: Maneuver) -> bool:
        """Return whether a lane key has done enough, and would do too much if it acted on."""
        side = 1.0 if key == LEFT else -1.0
        left_to_go = side * (self._aim - seen.beside)
        let_go = self._keys.let_go(seen)
        far = (
            side * float(let_go.beside[-1]) > left_to_go - _NEAR_ENOUGH
            and side * float(go_on.beside[-1]) > left_to_go + _TOO_FAR
        )
        return far or side * seen.heading > self._askew

    def _steer(self, seen: RoadSight, key: str, lane: int) -> str:
        """Note how far a lane key is to move the car, and return the key.

        Into its own lane the car need only be turned back.
        """
        self._aim = seen.beside + seen.to_middle_of(lane)
        self._askew = INWARDS if lane == seen.lane else _ASKEW
        return key

    def _aside(self, seen: RoadSight) -> str:
        """Return the key that turns a slow car away from what stands close ahead of it, if anything does."""
        gap, beside = next_standing(seen)
        if seen.speed > _SLOW or gap > STOPPING_ROOM:
            return ""
        side = -1.0 if beside > 0.0 else 1.0
        if (seen.left if side > 0.0 else seen.right) < LANE_WIDTH or side * seen.heading > _ASKEW:
            return ""
        self._aim, self._askew = seen.beside + beside + side * LANE_WIDTH, _ASKEW
        return LEFT if side > 0.0 else RIGHT

    def _release(self, seen: RoadSight) -> str:
        """Return the key with which a braked car can go on: the default key, or one for a lane."""
        if self._keys.time_since() < _BRAKE_TIME or (seen.speed > _SLOW and abs(seen.heading) > WEAVING):
            return ""
        options = [self._keys.let_go(seen), *self._keys.lane_changes(seen)]
        outlooks = [(predict_times_to_conflict(seen, one, ROOM_FOR_CROSSING, _DOUBT), one) for one in options]
        if outlooks[0][0].crossing == outlooks[0][0].first < math.inf:
            outlooks = outlooks[:1]
        free = [one.name for times, one in outlooks if math.isinf(times.first)]
        if free:
            return free[0]
        stays = predict_times_to_conflict(seen, self._keys.brake(seen))
        waited = min(self._halted_time(), self._keys.time_since()) > _BRAKED_TIME
        if not waited and math.isinf(stays.first):
            return ""
        times, best = max(outlooks, key=lambda pair: _preference(seen, *pair))
        nobody = math.isinf(min(times.moving, times.crossing))
        return best.name if times.first > stays.first or (waited and nobody) else ""

    def _start_again(self, seen: RoadSight) -> str:
        """Return the key that gets a halted car going: to a side if something is close ahead."""
        if self._keys.time_since() < _HALTED_TIME:
            return ""
        return self._aside(seen) or ACCELERATE

    def _halted_time(self) -> float:
        return (self._keys.step - self._rolled) * self._dt


def _improves(conflicts: TimesToConflict, expected: TimesToConflict) -> bool:
    """Return whether an option postpones the next conflict enough."""
    return conflicts.first > min(expected.first, HORIZON - IMPROVEMENT) + IMPROVEMENT - 1e-9


def _preference(seen: RoadSight, times: TimesToConflict, option: Maneuver) -> tuple[float, float, float]:
    """Return how good an option is: late conflicts first, then no key for a lane, then room on its side."""
    room = seen.left if option.name == LEFT else seen.right
    return min(times.first, HORIZON), {BRAKE: -1.0, DEFAULT: 1.0}.get(option.name, 0.0), room
