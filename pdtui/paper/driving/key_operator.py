"""The operator that shares control by keys (H*): it sees what the screen shows and presses few keys, late."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.paper.driving.key_effects import ACCELERATE, BRAKE, DEFAULT, LEFT, RIGHT, KeyEffects
from pdtui.paper.driving.maneuver import (
    HORIZON,
    TIMES,
    WEAVING,
    Maneuver,
    TimesToConflict,
    next_standing,
    predict_times_to_conflict,
    roll,
    swerve,
)
from pdtui.paper.driving.operator_memory import REACTION_TIME, JudgementErrors, OperatorMemory
from pdtui.paper.driving.road_sight import LANE_WIDTH, RoadSight

PRESSES_PER_SECOND = 3
"""Largest number of key presses in any second."""
PATIENCE_STANDING, PATIENCE_MOVING, PATIENCE_CROSSING, PATIENCE_EDGE = 4.0, 1.2, 2.6, 1.5
"""Times before a conflict at which it acts: with what stands, with who drives along the road, with who crosses
it, and with an edge, s."""
LAST_MOMENT = 0.7
"""Time before a conflict with an edge at which it brakes if no other key helps, s."""
IMPROVEMENT = 1.0
"""Time by which a key must postpone the next conflict, s."""
STOPPING_ROOM = 9.0
"""Distance from something that stands at which the car is to stop, m: to pass it afterwards, it needs room."""
_SPEEDING_UP, _CRUISING = 2.0, 8.0
"""How a slow car is expected to get faster, m/s², and the speed up to which, m/s."""
_SLOW = 2.0
"""Speed up to which a car turns back from an edge by itself, m/s."""
_KEY_DELAY = 0.2
"""Time until a key shows an effect, s."""
_HALTED, _HALTED_TIME = 0.5, 2.0
"""Speed of a car that has halted, m/s, and the time after which it should have gone on, s."""
_NEAR_ENOUGH, _TOO_FAR = 0.3, 0.8
"""How far from the middle of a lane a lane change may end, before it and beyond it, m."""
_NEAR_EDGE, _INWARDS = 0.6, 0.1
"""Distance from an edge of the road that is too small, m, unless the car turns away from it by an angle, rad."""
URGENT = 1.1
"""Time before a conflict at which it acts although it has just done something, s."""
_SETTLING = 0.6
"""Time after a lane key in which the car settles in its lane, s."""
_BRAKE_TIME = 0.5
"""Time for which it brakes at least, s."""
_DOUBT = 0.4
"""How much faster or slower somebody who crosses the road may turn than seen, rad/s."""
_TOO_ASKEW = 0.3
"""Angle to the road up to which a lane key may turn the car, rad."""
_BRAKED_TIME = 4.0
"""Time after which it lets a stopped car go on unless somebody comes, s."""


class KeyOperator:
    """Decides which key to press, from what there is to see.

    Args:
        effects: What the keys do.
        dt: Duration of a control step, s.
        judgement: How it judges what it sees.
    """

    def __init__(self, effects: KeyEffects, dt: float, judgement: JudgementErrors | None = None) -> None:
        self._effects, self._dt, self._judgement = effects, dt, judgement or JudgementErrors()
        self._memory = OperatorMemory(dt, self._judgement)
        self._second = math.ceil(1.0 / dt - 1e-9)
        self._step, self._rolled, self._aim = -1, 0, 0.0
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
        key = self._choose(self._with_own_keys(seen))
        if key:
            self._presses.append((self._step, key))
        return key

    def _hand_is_busy(self) -> bool:
        presses = self._presses[-PRESSES_PER_SECOND:]
        return len(presses) == PRESSES_PER_SECOND and self._step - presses[0][0] < self._second

    def _with_own_keys(self, seen: RoadSight) -> RoadSight:
        """Return what is to be expected by now of the key that was pressed after that moment."""
        key, _ = self._latched()
        since = min(self._time_since(), REACTION_TIME)
        if key == BRAKE:
            slower = min(seen.speed, self._effects.deceleration * since)
            return replace(seen, speed=seen.speed - slower, along=seen.along - slower * since / 2)
        if key in (LEFT, RIGHT) and since < REACTION_TIME:
            turned = self._effects.turn(key) * max(0.0, since - _KEY_DELAY)
            return replace(seen, heading=seen.heading + turned)
        return seen

    def _choose(self, seen: RoadSight) -> str:
        latched, left = self._latched()
        if latched == BRAKE:
            return self._release(seen)
        if min((self._step - self._rolled) * self._dt, self._time_since(DEFAULT)) > _HALTED_TIME:
            return self._start_again(seen)
        go_on, let_go = self._turn(seen, latched, left), self._turn(seen, DEFAULT, 0.0)
        expected = predict_times_to_conflict(seen, go_on)
        urgent = expected.first < URGENT and (expected.edge > URGENT or abs(seen.heading) > WEAVING)
        options = [*self._lane_changes(seen), Maneuver(BRAKE, *self._braked(seen))]
        if latched in (LEFT, RIGHT):
            if self._overshoots(seen, go_on, let_go):
                return DEFAULT
            options.append(let_go)
        if (side := self._slipping_off(seen)) and side != latched:
            self._aim = seen.beside + seen.to_middle_of(seen.lane)
            return side
        if not latched and (side := self._aside(seen)):
            return side
        if not urgent and (self._time_since(LEFT, RIGHT) < self._change_time() or not self._must_act(seen, expected)):
            return ""
        if not self._must_brake(seen, expected):
            options = [one for one in options if one.name != BRAKE]
        elif expected.crossing == expected.first:
            options = options[-1:] if options[-1].name == BRAKE else options[-2:]
        outlooks = [(predict_times_to_conflict(seen, one), one) for one in options]
        good = [(times, one) for times, one in outlooks if _improves(times, expected)]
        if not good:
            return ""
        key = max(good, key=lambda pair: self._preference(seen, *pair))[1].name
        if key in (LEFT, RIGHT):
            away = expected.edge == expected.first
            lane = seen.lane if away else seen.lane + (1 if key == LEFT else -1)
            self._aim = seen.beside + seen.to_middle_of(lane)
        return key

    def _slipping_off(self, seen: RoadSight) -> str:
        """Return the key that leads back from an edge that the car is slipping over, if it is."""
        side, key, outwards = (seen.left, RIGHT, 1.0) if seen.left < seen.right else (seen.right, LEFT, -1.0)
        return key if side < _NEAR_EDGE and outwards * seen.heading > -_INWARDS else ""

    def _change_time(self) -> float:
        """Return how long it leaves a lane key alone unless something is urgent, s."""
        return max(self._effects.pulse(LEFT), self._effects.pulse(RIGHT)) + _SETTLING

    def _overshoots(self, seen: RoadSight, go_on: Maneuver, let_go: Maneuver) -> bool:
        """Return whether a lane key has done enough, and would do too much if it acted on."""
        side = 1.0 if self._latched()[0] == LEFT else -1.0
        left_to_go = side * (self._aim - seen.beside)
        far = (
            side * float(let_go.beside[-1]) > left_to_go - _NEAR_ENOUGH
            and side * float(go_on.beside[-1]) > left_to_go + _TOO_FAR
        )
        return far or side * seen.heading > _TOO_ASKEW

    def _must_act(self, seen: RoadSight, expected: TimesToConflict) -> bool:
        patience = self._judgement.patience
        return (
            expected.standing < PATIENCE_STANDING * patience
            or expected.moving < PATIENCE_MOVING * patience
            or expected.crossing < PATIENCE_CROSSING * patience
            or (expected.edge < PATIENCE_EDGE * patience and abs(seen.heading) > WEAVING)
        )

    def _must_brake(self, seen: RoadSight, expected: TimesToConflict) -> bool:
        """Return whether the last moment to brake has come."""
        patience = self._judgement.patience
        stopping = seen.speed**2 / (2 * self._effects.deceleration) + 0.2 * seen.speed
        near = next_standing(seen)[0] < stopping + STOPPING_ROOM * patience
        return (
            (near and math.isfinite(expected.standing) and seen.speed > _SLOW)
            or expected.moving < PATIENCE_MOVING * patience
            or expected.crossing < PATIENCE_CROSSING * patience
            or (expected.edge < LAST_MOMENT * patience and abs(seen.heading) > WEAVING and seen.speed > _SLOW)
        )

    def _release(self, seen: RoadSight) -> str:
        """Return the key with which a braked car can go on: the default key, or one for a lane."""
        if self._time_since() < _BRAKE_TIME or (seen.speed > _SLOW and abs(seen.heading) > WEAVING):
            return ""
        options = [self._turn(seen, DEFAULT, 0.0), *self._lane_changes(seen)]
        outlooks = [(predict_times_to_conflict(seen, one, _DOUBT), one) for one in options]
        free = [one.name for times, one in outlooks if math.isinf(times.first)]
        if free:
            return free[0]
        stays = predict_times_to_conflict(seen, Maneuver("", *self._braked(seen)))
        waited = min((self._step - self._rolled) * self._dt, self._time_since()) > _BRAKED_TIME
        if not waited and math.isinf(stays.first):
            return ""
        times, best = max(outlooks, key=lambda pair: self._preference(seen, *pair))
        return best.name if times.first > stays.first or (waited and math.isinf(min(times.moving, times.crossing))) else ""

    def _lane_changes(self, seen: RoadSight) -> list[Maneuver]:
        """Return what the keys for lanes would do now, each pressed once or twice."""
        latched, left = self._latched()
        return [
            self._turn(seen, key, count * self._effects.pulse(key))
            for key, side in ((LEFT, 1), (RIGHT, -1))
            if key != latched or left < _KEY_DELAY
            if 0 <= seen.lane + side < seen.lanes or side * seen.heading < -WEAVING
            for count in (1, 2)
        ]

    def _turn(self, seen: RoadSight, key: str, duration: float) -> Maneuver:
        """Return how the car goes on with a key for some time and without one afterwards."""
        top = _CRUISING if seen.speed < _CRUISING else seen.speed
        ahead = roll(seen.speed, _SPEEDING_UP, top)
        latched, _ = self._latched()
        turn_now = self._effects.turn(latched) if latched in (LEFT, RIGHT) else 0.0
        turn = self._effects.turn(key) if key in (LEFT, RIGHT) else 0.0
        begins = 0.0 if key == latched else _KEY_DELAY
        turns = np.where((TIMES > begins) & (duration + begins > TIMES - 0.1), turn, 0.0)
        return Maneuver(key, ahead, swerve(seen, ahead, turns, turn_now))

    def _braked(self, seen: RoadSight) -> tuple[Floats, Floats]:
        ahead = roll(seen.speed, -self._effects.deceleration)
        return ahead, swerve(seen, ahead, np.zeros_like(TIMES))

    def _preference(
        self, seen: RoadSight, times: TimesToConflict, option: Maneuver
    ) -> tuple[float, float, float]:
        """Return how good an option is: late conflicts first, then no braking, then room on its side."""
        room = seen.left if option.name == LEFT else seen.right
        return min(times.first, HORIZON), {BRAKE: -1.0, DEFAULT: 1.0}.get(option.name, 0.0), room

    def _start_again(self, seen: RoadSight) -> str:
        """Return the key that gets a halted car going: to a side if something is close ahead."""
        if self._time_since() < _HALTED_TIME:
            return ""
        return self._aside(seen) or ACCELERATE

    def _aside(self, seen: RoadSight) -> str:
        """Return the key that turns a slow car away from what stands close ahead of it, if anything does."""
        gap, beside = next_standing(seen)
        if seen.speed > _SLOW or gap > STOPPING_ROOM:
            return ""
        self._aim = seen.beside + (beside - LANE_WIDTH if beside > 0.0 else beside + LANE_WIDTH)
        return RIGHT if beside > 0.0 else LEFT

    def _time_since(self, *keys: str) -> float:
        """Return how long ago one of the keys was pressed, or any if none is named, s."""
        steps = [step for step, key in self._presses if not keys or key in keys]
        return (self._step - steps[-1]) * self._dt if steps else math.inf

    def _latched(self) -> tuple[str, float]:
        """Return the key that still acts, and for how long, s."""
        if not self._presses:
            return "", 0.0
        step, key = self._presses[-1]
        left = self._effects.periods.get(key, math.inf) - (self._step - step) * self._dt
        return (key, left) if left > 0.0 and key != DEFAULT else ("", 0.0)


def _improves(conflicts: TimesToConflict, expected: TimesToConflict) -> bool:
    """Return whether an option postpones the next conflict enough."""
    return conflicts.first > min(expected.first, HORIZON - IMPROVEMENT) + IMPROVEMENT - 1e-9
