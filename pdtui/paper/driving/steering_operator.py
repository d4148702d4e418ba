"""The operator that steers (H^n and human only): it keeps to a lane and changes it when it must."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.paper.driving.key_operator import (
    IMPROVEMENT,
    PATIENCE_CROSSING,
    PATIENCE_EDGE,
    PATIENCE_MOVING,
    PATIENCE_STANDING,
)
from pdtui.paper.driving.maneuver import (
    GAP_BRAKED,
    HORIZON,
    ROOM_FOR_CROSSING,
    TIMES,
    WEAVING,
    Maneuver,
    find_passing_offset,
    predict_times_to_conflict,
    roll,
    slips_off,
    swerve,
)
from pdtui.paper.driving.operator_memory import JudgmentErrors, OperatorMemory
from pdtui.paper.driving.road_sight import CAR_HALF_LENGTH, CAR_HALF_WIDTH, LANE_WIDTH, ROAD_STEP, RoadSight

CRUISING_SPEED = 10.0
"""Speed at which it drives where nothing is in the way, m/s."""
_SIDEWAYS_ACCELERATION = 3.0
"""Largest acceleration to the side in a bend, m/s²."""
_CHANGE_TIME = 2.4
"""Time that it takes for a lane change, s."""
_LOOK_AHEAD, _LOOK_AHEAD_TIME = 5.0, 0.9
"""Distance of the place that it steers to: at rest, m, and per speed, s."""
_WHEELBASE, _LARGEST_ANGLE = 2.47, math.radians(40.0)
"""Distance between the axles, m, and the angle of the wheels at full steering, rad."""
_BRAKING, _HARD_BRAKING, _HEADWAY, _STANDSTILL_GAP = 3.0, 10.0, 1.2, 4.0
"""How hard it plans to brake, and can brake, m/s², and its distance from who is in front: per speed, s, and
at rest, m."""
_SLIPPING_SPEED = 3.0
"""Speed to which it brakes near an edge, m/s."""
_WAITING, _CREEPING_SPEED = 2.0, 1.5
"""Time after which it drives a halted car round what stands ahead, s, and how fast, m/s."""
_SOON = 0.5
"""Time over which it judges how fast others get away, s."""
_THROTTLE_GAIN = 0.3
"""Throttle per error of the speed, s/m."""
_HANDS_OFF_AFTER = 5
"""Control steps on a free road after which it hands back."""
_CENTERED, _STRAIGHT = 0.6, 0.06
"""Distance from the middle of the lane, m, and heading, rad, with which a lane change is over."""


@dataclass(frozen=True)
class ManualControlValues:
    """What the operator does with the wheel, to the left, and with the throttle, each in [−1, 1]."""

    steering: float
    throttle: float


class SteeringOperator:
    """Decides how to steer, and whether to, from what there is to see.

    Args:
        dt: Duration of a control step, s.
        judgment: How it judges what it sees.
        always: Whether it drives all the time, or takes over only where the car alone would come too close to
            something, until that is over.
    """

    def __init__(self, dt: float, judgment: JudgmentErrors | None = None, *, always: bool = False) -> None:
        self._judgment, self._always = judgment or JudgmentErrors(), always
        self._memory = OperatorMemory(dt, self._judgment)
        self._dt, self._target, self._driving, self._quiet, self._halted = dt, 0, False, 0, 0
        self._way_out: float | None = None

    def choose_controls(self, sight: RoadSight) -> ManualControlValues | None:
        """Observe the road and return what to do now, or None to leave it to the policy.

        Call it once per control step.
        """
        seen = self._memory.recall(sight)
        if seen is None:
            return ManualControlValues(0.0, 0.0) if self._always else None
        self._halted = self._halted + 1 if seen.speed < 0.5 else 0
        self._look_for_way_out(seen)
        if not self._driving:
            if not (self._always or self._must_act(seen)):
                return None
            self._driving, self._quiet, self._target = True, 0, seen.lane
        self._choose_lane(seen)
        if not self._always and self._is_over(seen):
            self._driving = False
            return None
        return self._drive(seen)

    def _must_act(self, seen: RoadSight) -> bool:
        ahead = roll(seen.speed, 0.0)
        expected = predict_times_to_conflict(
            seen, Maneuver("", ahead, swerve(seen, ahead, np.zeros_like(TIMES)))
        )
        patience = self._judgment.patience
        return (
            expected.standing < PATIENCE_STANDING * patience
            or expected.moving < PATIENCE_MOVING * patience
            or expected.crossing < PATIENCE_CROSSING * patience
            or (expected.edge < PATIENCE_EDGE * patience and abs(seen.heading) > WEAVING)
            or slips_off(seen) != 0
            or self._halted * self._dt > _WAITING
            or self._way_out is not None
        )

    def _look_for_way_out(self, seen: RoadSight) -> None:
        """Note how far beside the line a halted car can pass what stands ahead, until it has passed."""
        if self._halted * self._dt > _WAITING:
            way = find_passing_offset(seen, 2 * _STANDSTILL_GAP)
            self._way_out = seen.beside + way if way else None
        elif self._way_out is not None:
            ahead, beside, half_length, half_width = seen.standing().T
            near = (ahead + half_length > -CAR_HALF_LENGTH) & (ahead - half_length < 2 * _STANDSTILL_GAP)
            near &= np.abs(beside + seen.beside - self._way_out) < half_width + LANE_WIDTH
            self._way_out = self._way_out if near.any() else None

    def _is_over(self, seen: RoadSight) -> bool:
        centered = abs(seen.to_middle_of(self._target)) < _CENTERED and abs(seen.heading) < _STRAIGHT
        self._quiet = self._quiet + 1 if centered and not self._must_act(seen) else 0
        return self._quiet >= _HANDS_OFF_AFTER

    def _choose_lane(self, seen: RoadSight) -> None:
        """Choose another lane if that postpones the next conflict; it is kept until it is reached."""
        self._target = min(self._target, seen.lanes - 1)
        now = self._expect(seen, self._target)
        if now > PATIENCE_STANDING * self._judgment.patience:
            return
        near = [lane for lane in (seen.lane - 1, seen.lane, seen.lane + 1) if 0 <= lane < seen.lanes]
        later = {lane: self._expect(seen, lane) for lane in near}
        best = max(later, key=lambda lane: (min(later[lane], 2 * HORIZON), -abs(lane - seen.lane)))
        if later[best] > min(now, HORIZON - IMPROVEMENT) + IMPROVEMENT:
            self._target = best

    def _expect(self, seen: RoadSight, lane: int) -> float:
        """Return the time of the first conflict on the way to a lane and along it, s."""
        speed = max(seen.speed, 3.0)
        share = np.clip(TIMES / _CHANGE_TIME, 0.0, 1.0)
        beside = seen.to_middle_of(lane) * share * share * (3.0 - 2.0 * share)
        return predict_times_to_conflict(seen, Maneuver("", roll(speed, 0.0), beside)).first

    def _drive(self, seen: RoadSight) -> ManualControlValues:
        road = seen.road_ahead()
        slips = slips_off(seen) != 0
        if self._way_out is None:
            beside = seen.to_middle_of(self._target) + seen.beside
            distance = _LOOK_AHEAD + (0.0 if slips else _LOOK_AHEAD_TIME * seen.speed)
            speed = min(CRUISING_SPEED, _bend_speed(road), self._following_speed(seen))
        else:
            beside, distance, speed = self._way_out, _LOOK_AHEAD / 2, _CREEPING_SPEED
        x, y = _place_ahead(road, distance, beside)
        angle = math.atan(2.0 * _WHEELBASE * y / max(x * x + y * y, 1.0))
        stops = self._must_let_pass(seen) or (slips and seen.speed > _SLIPPING_SPEED)
        throttle = -1.0 if stops else _THROTTLE_GAIN * (speed - seen.speed)
        if abs(seen.heading) > math.pi / 2:  # it was turned round, and the place is behind it
            angle = -math.copysign(_LARGEST_ANGLE, seen.heading)
        return ManualControlValues(
            float(np.clip(angle / _LARGEST_ANGLE, -1.0, 1.0)), float(np.clip(throttle, -1.0, 1.0))
        )

    def _must_let_pass(self, seen: RoadSight) -> bool:
        """Return whether somebody crosses the road so that it is better to stop."""
        here = np.zeros_like(TIMES)
        ahead = roll(max(seen.speed, 3.0), 0.0)
        goes = predict_times_to_conflict(seen, Maneuver("", ahead, here), ROOM_FOR_CROSSING)
        if goes.crossing > PATIENCE_CROSSING * self._judgment.patience:
            return False
        braked = Maneuver("", roll(seen.speed, -_HARD_BRAKING), here, GAP_BRAKED)
        stops = predict_times_to_conflict(seen, braked)
        shorter = stops.crossing == goes.crossing and stops.duration < goes.duration
        return stops.crossing > goes.crossing or shorter

    def _following_speed(self, seen: RoadSight) -> float:
        """Return the speed at which the car does not run into what is in front of it on its way, m/s."""
        now, soon = np.moveaxis(seen.foresee(np.array([0.0, _SOON])), 1, 0)
        ahead, beside, half_length, half_width = now.T
        speed = (soon[:, 0] - ahead) / _SOON
        gaps = ahead - half_length - CAR_HALF_LENGTH
        to = seen.to_middle_of(self._target)
        reach = half_width + CAR_HALF_WIDTH + 0.3
        # A lane change leaves what is far enough away behind.
        here = (np.abs(beside) < reach) & (gaps < _STANDSTILL_GAP + LANE_WIDTH / 2 + abs(to))
        there = np.abs(beside - to) < reach
        front = (ahead > 0.0) & (here | there)
        if not front.any():
            return math.inf
        room = np.maximum(gaps[front] - _STANDSTILL_GAP, 0.0)
        ahead_speed = np.maximum(speed[front], 0.0)
        return float(
            np.min(np.minimum(np.sqrt(ahead_speed**2 + 2 * _BRAKING * room), ahead_speed + room / _HEADWAY))
        )


def _place_ahead(road: Floats, distance: float, beside: float) -> tuple[float, float]:
    """Return a place beside the middle line, forward and to the left in the car's own directions, m."""
    index = min(len(road) - 2, int(distance / ROAD_STEP))
    along = road[index + 1] - road[index]
    along = along / np.hypot(*along)
    x, y = road[index] + along * (distance - index * ROAD_STEP) + beside * np.array([-along[1], along[0]])
    return float(x), float(y)


def _bend_speed(road: Floats) -> float:
    """Return the speed that the bend ahead allows, m/s."""
    steps = np.diff(road[:12], axis=0)
    turns = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
    curvature = float(np.convolve(turns, np.ones(4) / 4, "valid").max()) / ROAD_STEP
    return math.sqrt(_SIDEWAYS_ACCELERATION / max(curvature, 1e-3))
