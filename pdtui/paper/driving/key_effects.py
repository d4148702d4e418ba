"""What the driver's keys do, measured on straight roads: how far a lane key moves the car, how it brakes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import RobotError
from pdtui.driving.control_loop import ControlLoop
from pdtui.paper.driving.maneuver import STRAIGHTENING_TIME
from pdtui.paper.driving.road_sight import LANE_WIDTH
from pdtui.paper.operator_behaviors import find_operator_behaviors
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

DEFAULT, BRAKE, ACCELERATE, LEFT, RIGHT = "default", "brake", "accelerate", "lane left", "lane right"
TASKS = (BRAKE, ACCELERATE, LEFT, RIGHT)
"""Tasks for which the operator needs behaviors, whatever their names."""
STRAIGHT = "straight"
"""Start of the drives on which effects are measured: roads of three lanes without traffic."""
MEASURING_SEEDS = (1000, 1001, 1002)
"""Seeds of these drives."""
_STEPS_BEFORE, _STEPS_WATCHED = 60, 40
_SETTLED = 0.9
"""Share of the way to the side after which a lane change counts as over."""
_STOPPED = 0.2
"""Share of the speed at which the car counts as braked."""


@dataclass(frozen=True)
class KeyEffects:
    """What the keys do.

    Attributes:
        left, right: How far the keys for lanes have moved the car to the left, m, at each control step from
            the press on.
        settling_time: Time that a lane change takes, s.
        deceleration: How the brake slows the car down, m/s².
        speed: The car's speed at the presses, m/s.
        dt: Duration of a control step, s.
        periods: Activation periods by task, s, of the behaviors that have one.
    """

    left: tuple[float, ...]
    right: tuple[float, ...]
    settling_time: float
    deceleration: float
    speed: float
    dt: float
    periods: Mapping[str, float] = field(default_factory=dict)

    def pulse(self, key: str) -> float:
        """Return how long a lane key acts, s."""
        return self.periods.get(key, self.settling_time)

    def turn(self, key: str) -> float:
        """Return how fast a lane key turns the car to the left while it acts, rad/s.

        It is that turn which moves a car as far as was measured if it straightens by itself meanwhile and
        afterwards.
        """
        shift = max(self.left) if key == LEFT else min(self.right)
        return shift / (self.speed * self.pulse(key) * STRAIGHTENING_TIME)


def driving_behaviors(stimulation_map: StimulationMap) -> dict[str, Behavior]:
    """Return the behaviors that the operator uses by task; one without a task counts by its name.

    Raises:
        MapError: The map lacks a behavior for a task.
    """
    return find_operator_behaviors(stimulation_map, TASKS)


def measure_key_effects(loops: Iterable[ControlLoop]) -> KeyEffects:
    """Press the keys for both lanes and the brake in each drive, one after the other, and watch the car.

    Args:
        loops: Drives on straight roads of three lanes, before their first steps, all with one map.

    Raises:
        MapError: As `driving_behaviors`.
        RobotError: The car left the road in every drive.
    """
    watched = {LEFT: list[Floats](), RIGHT: list[Floats](), BRAKE: list[Floats]()}
    for loop in loops:
        behaviors, dt = driving_behaviors(loop.map), loop.robot.control_dt
        _press_one_by_one(loop, behaviors, watched)
    missing = [key for key, drives in watched.items() if not drives]
    if missing:
        raise RobotError(
            f"{loop.map.source}: the car left every straight road before or after '{missing[0]}'"
        )
    left, right = (np.mean([one[:, 1] - one[0, 1] for one in watched[key]], axis=0) for key in (LEFT, RIGHT))
    speeds = np.mean([one[:, 0] for one in watched[BRAKE]], axis=0)
    slow = np.flatnonzero(speeds < _STOPPED * speeds[0])
    steps = int(slow[0]) if len(slow) else len(speeds) - 1
    return KeyEffects(
        tuple(left.tolist()),
        tuple(right.tolist()),
        dt * max(_settling_step(left), _settling_step(right)),
        float(speeds[0] - speeds[steps]) / (steps * dt),
        float(np.mean([one[0, 0] for drives in watched.values() for one in drives])),
        dt,
        {task: one.period for task, one in behaviors.items() if one.period is not None},
    )


def _press_one_by_one(
    loop: ControlLoop, behaviors: Mapping[str, Behavior], watched: Mapping[str, list[Floats]]
) -> None:
    columns = [loop.robot.attribute_index(name) for name in ("speed", "left distance", "right distance")]

    def read() -> tuple[float, float]:
        speed, left, right = loop.attributes[columns].tolist()
        return speed, (right - left) / 2

    for _ in range(_STEPS_BEFORE):
        if loop.advance().ended:
            return
    # From the lane at the left edge, only the other way is free.
    keys: Sequence[str] = (RIGHT, LEFT) if read()[1] > LANE_WIDTH / 2 else (LEFT, RIGHT)
    for key in (*keys, BRAKE):
        seen = [read()]
        for step in range(_STEPS_WATCHED):
            event = DriveEvent(loop.step, "behavior", behaviors[key].name)
            if loop.advance([] if step else [event]).ended:
                return
            seen.append(read())
        watched[key].append(np.array(seen))
        loop.advance([DriveEvent(loop.step, "default")])


def _settling_step(moved: Floats) -> int:
    return int(np.argmax(np.abs(moved) >= _SETTLED * np.abs(moved).max()))
