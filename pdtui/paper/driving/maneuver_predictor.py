"""What the car would do with each key, from what there is to see and the keys that were pressed before."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pdtui.paper.driving.key_effects import BRAKE, DEFAULT, LEFT, RIGHT, KeyEffects
from pdtui.paper.driving.maneuver import TIMES, WEAVING, Maneuver, roll, swerve
from pdtui.paper.driving.operator_memory import REACTION_TIME
from pdtui.paper.driving.road_sight import RoadSight

KEY_DELAY = 0.2
"""Time until a key shows an effect, s."""
_SPEEDING_UP, _CRUISING = 2.0, 8.0
"""How a slow car is expected to get faster, m/s², and the speed up to which, m/s."""


class ManeuverPredictor:
    """The keys pressed so far, and what each key would do now.

    Args:
        effects: What the keys do.
        dt: Duration of a control step, s.
    """

    def __init__(self, effects: KeyEffects, dt: float) -> None:
        self._effects, self._dt = effects, dt
        self.presses: list[tuple[int, str]] = []
        self.step = -1

    def press(self, key: str) -> None:
        """Note that a key is pressed now."""
        self.presses.append((self.step, key))

    def time_since(self, *keys: str) -> float:
        """Return how long ago one of the keys was pressed, or any if none is named, s."""
        steps = [step for step, key in self.presses if not keys or key in keys]
        return (self.step - steps[-1]) * self._dt if steps else math.inf

    def find_active_key(self) -> tuple[str, float]:
        """Return the key that still acts, and the time left until it ends, s."""
        if not self.presses:
            return "", 0.0
        key = self.presses[-1][1]
        left = self._effects.periods.get(key, math.inf) - self.time_since()
        return (key, left) if left > 0.0 and key != DEFAULT else ("", 0.0)

    def predict_sight(self, seen: RoadSight) -> RoadSight:
        """Return what is seen with what is to be expected of a key that was pressed after that moment."""
        key, _ = self.find_active_key()
        since = min(self.time_since(), REACTION_TIME)
        if key == BRAKE:
            slower = min(seen.speed, self._effects.deceleration * since)
            return replace(seen, speed=seen.speed - slower, along=seen.along - slower * since / 2)
        if key in (LEFT, RIGHT) and since < REACTION_TIME:
            turned = self._effects.turn(key) * max(0.0, since - KEY_DELAY)
            return replace(seen, heading=seen.heading + turned)
        return seen

    def longest_lane_pulse(self) -> float:
        """Return how long the lane key that acts longer does, s."""
        return max(self._effects.pulse(LEFT), self._effects.pulse(RIGHT))

    def stopping_distance(self, speed: float) -> float:
        """Return the distance within which the brake stops the car, m."""
        return speed**2 / (2 * self._effects.deceleration)

    def go_on(self, seen: RoadSight) -> Maneuver:
        """Return how the car goes on with the key that still acts."""
        return self._turn(seen, *self.find_active_key())

    def let_go(self, seen: RoadSight) -> Maneuver:
        """Return how the car goes on after the default key."""
        return self._turn(seen, DEFAULT, 0.0)

    def brake(self, seen: RoadSight) -> Maneuver:
        """Return how the car stops."""
        ahead = roll(seen.speed, -self._effects.deceleration)
        return Maneuver(BRAKE, ahead, swerve(seen, ahead, np.zeros_like(TIMES)))

    def lane_changes(self, seen: RoadSight) -> list[Maneuver]:
        """Return what the keys for lanes would do now, each pressed once or twice.

        There must be a lane on that side, unless the car is turned away from it.
        """
        latched, left = self.find_active_key()
        return [
            self._turn(seen, key, count * self._effects.pulse(key))
            for key, side in ((LEFT, 1), (RIGHT, -1))
            if key != latched or left < KEY_DELAY
            if 0 <= seen.lane + side < seen.lanes or side * seen.heading < -WEAVING
            for count in (1, 2)
        ]

    def _turn(self, seen: RoadSight, key: str, duration: float) -> Maneuver:
        """Return how the car goes on with a key for some time and without one afterwards."""
        ahead = roll(seen.speed, _SPEEDING_UP, max(seen.speed, _CRUISING))
        latched, _ = self.find_active_key()
        turn_now = self._effects.turn(latched) if latched in (LEFT, RIGHT) else 0.0
        turn = self._effects.turn(key) if key in (LEFT, RIGHT) else 0.0
        begins = 0.0 if key == latched else KEY_DELAY
        turns = np.where((begins < TIMES) & (duration + begins > TIMES - 0.1), turn, 0.0)
        return Maneuver(key, ahead, swerve(seen, ahead, turns, turn_now))
