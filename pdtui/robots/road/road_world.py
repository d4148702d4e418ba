"""MetaDrive in a process of its own: one engine a process, in its main thread, and no assets."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome
from pdtui.core.processes.process_checkpoint import hold_state, return_and_release_state, return_to_held_state
from pdtui.core.scenery import Scenery, Traffic
from pdtui.robots.road.metadrive_repairs import (
    LIDAR_RANGE,
    LIDAR_RAYS,
    OTHER_CARS,
    blocks_without_ramps,
    repair_observation,
)
from pdtui.robots.road.road_scenery import TrafficReader, read_scenery
from pdtui.robots.road.road_scenes import SceneKind, find_scene

MAX_STEPS = 1000
# Speed that the rule-based driver aims at, km/h.
_RULES_SPEED = 35.0
_QUARTER_TURN = math.sqrt(0.5)
_WORDS = (
    ("arrive_dest", Outcome.ARRIVED),
    ("out_of_road", Outcome.LEFT_ROAD),
    # An episode that a crash does not end may run out of time while the car touches something.
    ("max_step", Outcome.OUT_OF_TIME),
    ("crash_vehicle", Outcome.CRASHED),
    ("crash_object", Outcome.CRASHED),
    ("crash_building", Outcome.CRASHED),
    ("crash_human", Outcome.CRASHED),
)


@dataclass(frozen=True)
class CarState:
    """What is known of the car after a control step.

    Attributes:
        observation: What the policy observes, shape (275,).
        reward, cost: Reward and cost of the step.
        outcome: How the episode ended; None if it goes on.
        motion: Speed (m/s), offset from the middle of the lane to the left (m), distances to the left and the
            right edge of the road (m), heading relative to the lane's (rad), yaw rate (rad/s), steering and
            throttle in [−1, 1], distance to what is next in the lane (m) and the driven share of the route.
        pose: Position (m) and quaternion w x y z, shape (7,).
        digest: 63-bit digest of all that moves.
    """

    observation: NDArray[np.float32]
    reward: float
    cost: float
    outcome: Outcome | None
    motion: Floats
    pose: Floats
    digest: int


class RoadWorld:
    """The engine, the car and the traffic.

    Args:
        crashes_end: Whether a crash ends the episode.
    """

    def __init__(self, crashes_end: bool) -> None:
        os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
        from metadrive.engine.base_engine import BaseEngine

        # A headless engine needs none of the textures, which MetaDrive would download.
        BaseEngine.try_pull_asset = staticmethod(lambda: None)
        self._crashes_end = crashes_end
        self._rules: Any = None
        self._traffic = TrafficReader()
        self._env: Any = None
        self._kind: SceneKind | None = None

    def reset(self, start: str, seed: int, exactly: bool) -> CarState:
        """Begin an episode.

        Args:
            start: Kind of scene, or one test scene.
            seed: Chooses one of the kind's scenes.
            exactly: Whether the episode must repeat itself to the last bit, which takes a new engine.

        Raises:
            RobotError: There is no such start.
        """
        kind, scene = find_scene(start, seed)
        if exactly or self._env is None or kind != self._kind:
            self.close()
            self._env, self._kind = self._make(kind), kind
        observed, _ = self._env.reset(seed=scene)
        self._rules, self._traffic = None, TrafficReader()
        self._cost = 0.0
        return self._state(observed, 0.0, {})

    def step(self, action: NDArray[np.float32]) -> CarState:
        """Drive for a tenth of a second.

        Args:
            action: Steering to the left and throttle, each in [−1, 1]; a negative throttle brakes.
        """
        observed, reward, terminated, truncated, info = self._env.step(action.tolist())
        return self._state(
            observed, float(reward), info if terminated or truncated else {"cost": info["cost"]}
        )

    def read_scenery(self) -> Scenery:
        """Return the road, the route and the cones of the episode."""
        return read_scenery(self._env)

    def read_traffic(self) -> Traffic:
        """Return cars, barriers and what the lidar hits, as they are now."""
        return self._traffic.read(self._env, self._observation)

    def hold_state(self) -> None:
        """Keep the state for `return_to_held_state`, until `return_and_release_state`.

        It answers again after each of the two.
        """
        hold_state()

    def return_to_held_state(self) -> None:
        """Return to the state that is held; it never returns here."""
        return_to_held_state()

    def return_and_release_state(self) -> None:
        """Go on from the state that was held, and hold it no longer; it never returns here."""
        return_and_release_state()

    def suggest_action(self) -> NDArray[np.float32]:
        """Return what MetaDrive's rule-based driver, which keeps lane and distance, would do now."""
        from metadrive.policy.idm_policy import IDMPolicy

        if self._rules is None:
            self._rules = IDMPolicy(self._env.agent, random_seed=0)
            self._rules.NORMAL_SPEED = _RULES_SPEED
        return np.clip(np.array(self._rules.act(), np.float32), -1.0, 1.0)

    def close(self) -> None:
        """End the engine."""
        if self._env is not None:
            self._env.close()
            self._env = None

    def _make(self, kind: SceneKind) -> Any:
        from metadrive.component.pgblock.first_block import FirstPGBlock
        from metadrive.constants import DEFAULT_AGENT
        from metadrive.envs.safe_metadrive_env import SafeMetaDriveEnv

        lane = (FirstPGBlock.NODE_1, FirstPGBlock.NODE_2, int(kind.middle_lane))
        lidar = {
            "num_lasers": LIDAR_RAYS,
            "distance": LIDAR_RANGE,
            "num_others": OTHER_CARS,
            "gaussian_noise": 0.0,
            "dropout_prob": 0.0,
        }
        return SafeMetaDriveEnv(
            {
                "start_seed": kind.first,
                "num_scenarios": kind.count,
                "accident_prob": kind.accident_probability,
                "traffic_density": kind.traffic_density,
                "map": kind.blocks,
                "block_dist_config": blocks_without_ramps(),
                "horizon": MAX_STEPS,
                "out_of_route_done": True,
                "crash_vehicle_done": self._crashes_end,
                "crash_object_done": self._crashes_end,
                "vehicle_config": {"lidar": lidar},
                "random_spawn_lane_index": not kind.middle_lane,
                "agent_configs": {DEFAULT_AGENT: {"use_special_color": True, "spawn_lane_index": lane}},
                "log_level": 50,
            }
        )

    def _state(self, observed: NDArray[np.float32], reward: float, info: dict[str, Any]) -> CarState:
        car, self._observation = self._env.agent, repair_observation(observed)
        outcome = next((word for key, word in _WORDS if info.get(key)), None)
        return CarState(
            self._observation,
            reward,
            float(info.get("cost", 0.0)),
            outcome,
            self._motion(car),
            _pose(car),
            self._digest(),
        )

    def _motion(self, car: Any) -> Floats:
        lane = car.lane
        along, beside = lane.local_coordinates(car.position)
        heading = (car.heading_theta - lane.heading_theta_at(along) + math.pi) % (2.0 * math.pi) - math.pi
        turned = car.heading_theta - math.atan2(car.last_heading_dir[1], car.last_heading_dir[0])
        turned = (turned + math.pi) % (2.0 * math.pi) - math.pi
        steering, throttle = car.last_current_action[-1]
        return np.array(
            [
                car.speed,
                -beside,
                car.dist_to_left_side,
                car.dist_to_right_side,
                heading,
                turned / 0.1,
                steering,
                throttle,
                self._gap_ahead(car),
                car.navigation.route_completion,
            ],
            np.float64,
        )

    def _gap_ahead(self, car: Any) -> float:
        """Return the distance to what is next in front within a car's width, at most the lidar's range, m."""
        gap = LIDAR_RANGE
        for thing in self._env.engine.get_sensor("lidar").get_surrounding_objects(car, int(LIDAR_RANGE)):
            ahead, beside = car.convert_to_local_coordinates(thing.position, car.position)
            reach = 0.5 * (float(getattr(thing, "LENGTH", 0.4)) + car.LENGTH)
            width = 0.5 * (float(getattr(thing, "WIDTH", 0.4)) + car.WIDTH)
            if ahead > 0.0 and abs(beside) < width:
                gap = min(gap, max(ahead - reach, 0.0))
        return gap

    def _digest(self) -> int:
        digest = blake2b(digest_size=8)
        for thing in sorted(self._env.engine.get_objects().values(), key=_place):
            place, velocity = thing.origin.getPos(), thing.body.getLinearVelocity()
            digest.update(np.array([*place, *velocity, thing.heading_theta], np.float64).tobytes())
        return int.from_bytes(digest.digest(), "little") >> 1


def _place(thing: Any) -> tuple[float, ...]:
    return tuple(thing.origin.getPos())


def _pose(car: Any) -> Floats:
    # A car of MetaDrive heads along its own y axis; ours, as all robots, along x.
    w, x, y, z = _QUARTER_TURN * np.array(car.origin.getQuat())
    return np.array([*car.origin.getPos(), w - z, x + y, y - x, z + w], np.float64)
