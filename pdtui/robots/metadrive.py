"""A car on MetaDrive's roads: the extra ``driving``, for Python before 3.12."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome
from pdtui.core.processes.process_checkpoint import can_hold_state
from pdtui.core.processes.worker_pool import WorkerProcess
from pdtui.core.robot_links_and_state import Link, ManualControl, RobotState
from pdtui.core.scenery import Traffic
from pdtui.robots.environments.action_log import ActionLog
from pdtui.robots.road.car_observation_edits import (
    CAR_OBSERVATION_EDITS,
    SPEED_OFFSET,
    SPEED_SCALE,
    WIDEST_LANE,
    WIDEST_ROAD,
)
from pdtui.robots.road.car_tasks import CAR_GOALS, CAR_TASKS
from pdtui.robots.road.metadrive_repairs import LIDAR_RANGE, OBSERVATIONS
from pdtui.robots.road.road_scenes import SCENE_STARTS
from pdtui.robots.road.road_world import CarState, RoadWorld
from pdtui.robots.robot import ResetResult, Robot, StepResult
from pdtui.robots.training_recipe import TrainingRecipe

_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
# What `restore` is off by where the engine is kept: at most 1.2e-4 within 120 steps after one start on an
# empty road. Other starts, and traffic, were not measured.
_NEAR = 2e-4


class MetaDrive(Robot):
    """A car of MetaDrive 0.4.3 on generated roads of three lanes; a control step is 0.1 s.

    The observation (275) is MetaDrive's, repaired: the car's own state (9), the next two checkpoints of its
    route (10), the four nearest cars (16) and 240 lidar rays of 50 m. All numbers lie in [0, 1]. The action
    (2) is steering, positive to the left, and throttle, negative to brake.

    The reward is the progress along the road in m plus a tenth of the speed's share of 80 km/h, 10 on
    arrival, and −5 off the road and at every step in contact with a car or an obstacle. A contact also costs
    1 at each step with a car, and once with each obstacle; leaving the road costs 1 and ends the episode.

    Args:
        scenes: Scenes in which episodes start unless `reset` says otherwise; see `starts`.
        crashes_end: Whether a crash ends the episode.
    """

    name = "metadrive"
    title = "car (MetaDrive)"
    needed_package = "metadrive"
    starts = SCENE_STARTS
    goals = CAR_GOALS
    tasks = CAR_TASKS
    observation_edits = CAR_OBSERVATION_EDITS
    # Terminals repeat a key that is held, which then outruns the steering's way back.
    manual_controls = (
        ManualControl("steering", 0, "sideways", step=0.1, return_rate=0.5),
        ManualControl("throttle", 1, "lengthways", step=0.25),
    )
    outcomes = (Outcome.ARRIVED, Outcome.CRASHED, Outcome.LEFT_ROAD)
    episode_steps = 1000
    control_dt = 0.1
    training_recipe = TrainingRecipe(
        options={"scenes": "training", "crashes_end": True},
        robot_batch="pdtui.training.metadrive_batch:MetaDriveBatch",
        settings={
            "worlds": 10,
            "chunk": 204,
            "minibatch": 256,
            "epochs": 6,
            "total_steps": 300_000,
            "evaluate_every": 60_000,
            "evaluate_episodes": 20,
            "imitates": True,
            "critic_iterations": 6,
            "log_std": -1.5,
            "divergence": 0.012,
            "evaluate_robots": 2,
            "reward_scale": 0.1,
            "least_deviation": 0.1,
            "average_rate": 0.01,
        },
        sac_settings={
            "worlds": 6,
            "chunk": 20,
            "steps_per_update": 1,
            "batch": 256,
            "evaluate_every": 30_000,
            "random_steps": 24_000,
            "average_rate": 0.002,
        },
    )
    attributes = (
        Attribute("speed", "m/s", SPEED_SCALE, offset=SPEED_OFFSET),
        Attribute("lane offset", "m", -1.0 / WIDEST_LANE, offset=0.5),
        Attribute("left distance", "m", 1.0 / WIDEST_ROAD),
        Attribute("right distance", "m", 1.0 / WIDEST_ROAD),
        Attribute("heading", "rad", -0.5, offset=0.5),
        Attribute("yaw rate", "rad/s"),
        Attribute("steering", "", 0.5, offset=0.5),
        Attribute("throttle", "", 0.5, offset=0.5),
        Attribute("gap ahead", "m", 1.0 / LIDAR_RANGE),
        Attribute("route", ""),
    )
    repeats_actions = True
    links = (
        Link("body", 0, "box", (2.25, 0.93, 0.35), (0.0, 0.0, 0.0), _UPRIGHT),
        Link("cabin", 0, "box", (1.1, 0.8, 0.3), (-0.3, 0.0, 0.65), _UPRIGHT),
    )

    def __init__(self, scenes: str = "quiet", crashes_end: bool = False) -> None:
        if importlib.util.find_spec(self.needed_package) is None:
            raise RobotError("robot 'metadrive' needs Python before 3.12 and: pip install 'pdtui[driving]'")
        self._scenes, self._crashes_end = self.check_start(scenes), crashes_end
        self.observation_space = gymnasium.spaces.Box(0.0, 1.0, (OBSERVATIONS,), np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self._process = WorkerProcess("the roads", RoadWorld, crashes_end)
        self._actions = ActionLog(2)
        self._seed, self._start = 0, self._scenes
        self._keeps_engine, self._shown = False, ("", -1)
        self._state: CarState
        self._held_state: CarState
        self._held: tuple[int, int, bytes] | None = None

    def make_alike(self) -> MetaDrive:
        """Return another car with the same options, whose resets keep the engine."""
        car = MetaDrive(self._scenes, self._crashes_end)
        car.allow_near_restores()
        return car

    def allow_near_restores(self) -> float:
        self._keeps_engine = True
        return _NEAR

    def close(self) -> None:
        self._process.close()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> ResetResult:
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(2**31)) if seed is None else seed
        start = self.check_start(str((options or {}).get("start", ""))) or self._scenes
        self._begin(start, drawn, exactly=not self._keeps_engine)
        return self.observe(), {}

    def step(self, action: NDArray[np.float32]) -> StepResult:
        self.send_action(action)
        return self.receive_step()

    def send_action(self, action: NDArray[np.float32]) -> None:
        """Begin a step, so that several cars can drive at once."""
        action = np.asarray(action, np.float32)
        self._actions.append(action)
        self._process.send(RoadWorld.step, action)

    def receive_step(self) -> StepResult:
        """Return what `step` returns, for the action that was sent."""
        self._state = self._process.receive()
        outcome = self._state.outcome
        info: dict[str, Any] = {"cost": self._state.cost}
        if outcome is not None:
            info |= {"reason": outcome.value, "outcome": outcome}
        timed_out = outcome is Outcome.OUT_OF_TIME
        terminated = outcome is not None and not timed_out
        return self.observe(), self._state.reward, terminated, timed_out, info

    def ask_rules(self) -> None:
        """Ask MetaDrive's rule-based driver, so that several cars can be asked at once."""
        self._process.send(RoadWorld.suggest_action)

    def receive_suggestion(self) -> NDArray[np.float32]:
        """Return what the rule-based driver would do now: steering and throttle."""
        suggested: NDArray[np.float32] = self._process.receive()
        return suggested

    def observe(self) -> Floats:
        return self._state.observation.astype(np.float64)

    def read_attributes(self) -> Floats:
        return self._state.motion

    def read_traffic(self) -> Traffic:
        traffic: Traffic = self._ask(RoadWorld.read_traffic)
        return traffic

    def read_poses(self) -> Floats:
        return self._state.pose[None]

    def digest(self) -> int:
        return self._state.digest

    def snapshot(self) -> RobotState:
        mark = np.array([self._seed, self.starts.index(self._start)], np.int64).view(np.float64)
        return RobotState(self.name, self._actions.so_far(), (mark,), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self._check_snapshot(snapshot)
        seed, start = (int(value) for value in snapshot.extras[0].view(np.int64))
        wanted, actions = (start, seed, snapshot.state.tobytes()), snapshot.state.astype(np.float32)
        if wanted == self._held:
            self._ask(RoadWorld.return_to_held_state)
            self._state, self._actions = self._held_state, ActionLog(2)
            for action in actions:
                self._actions.append(action)
        else:
            self._begin(self.starts[start], seed, exactly=not self._keeps_engine)
            for action in actions:
                self.step(action)
            if self._keeps_engine and can_hold_state():
                self._ask(RoadWorld.hold_state)
                self._held, self._held_state = wanted, self._state
        self.np_random.bit_generator.state = snapshot.rng

    def _begin(self, start: str, seed: int, exactly: bool) -> None:
        if self._held is not None:
            self._ask(RoadWorld.return_and_release_state)
            self._held = None
        self._seed, self._start, self._actions = seed, start, ActionLog(2)
        self._state = self._ask(RoadWorld.reset, start, seed, exactly)
        if self._shown != (start, seed):
            self.scenery, self._shown = self._ask(RoadWorld.read_scenery), (start, seed)

    def _ask(self, function: Callable[..., Any], *arguments: Any) -> Any:
        self._process.send(function, *arguments)
        return self._process.receive()
