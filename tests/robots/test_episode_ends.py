"""Episodes end in several ways: some of them are failures, and nobody steps a robot past any of them."""

from __future__ import annotations

from functools import cache
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from pdtui.api import load_policy
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome, is_failure
from pdtui.core.robot_links_and_state import RobotState
from pdtui.core.units import NO_STIMULATION
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.headless_drive import drive_headless
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.start_states import collect_start_states, measure_walk_lengths
from pdtui.probing.stimulated_rollout import run_rollout
from pdtui.robots.environments.plain_gymnasium_robot import PlainGymnasiumRobot
from pdtui.robots.robot import Robot
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict
from pdtui.search.task_rollout import StimulationWithDuration, judge_stimulations
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.stimulation.map_reader import parse_map

LAST = 20
"""Control steps of every episode."""


class Sprinter(Robot):
    """A robot whose episodes end after 20 control steps and which cannot be stepped any further.

    It says how they end, unless it is one of those that keep silent.
    """

    name = title = "sprinter"
    attributes = (Attribute("place", "m"), Attribute("speed", "m/s"))
    links = ()
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
    control_dt = 0.05

    def __init__(self, end: str, *, silent: bool = False) -> None:
        self.end, self.silent, self.state = end, silent, np.zeros(2)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.state = np.zeros(2)
        return self.observe(), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        del action
        assert self.state[1] < LAST, "stepped past the end of its episode"
        self.state += (0.05, 1.0)
        over = bool(self.state[1] == LAST)
        info: dict[str, Any] = {"cost": 0.0, "reason": self.end}
        if self.silent:
            info["finished"] = over and self.end == "arrived"
        elif over:
            info["outcome"] = self.end
        return (
            self.observe(),
            1.0,
            over and self.end != "out of time",
            over and self.end == "out of time",
            info,
        )

    def observe(self) -> Floats:
        return self.state.copy()

    def read_attributes(self) -> Floats:
        return np.array([self.state[0], 1.0])

    def read_poses(self) -> Floats:
        return np.array([[self.state[0], 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])

    def snapshot(self) -> RobotState:
        return RobotState(self.name, self.state.copy(), (), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self.state = snapshot.state.copy()

    def digest(self) -> int:
        return int(self.state[1])


@cache
def _policy() -> Policy:
    network = torch.nn.Sequential(torch.nn.Linear(2, 2), torch.nn.Tanh(), torch.nn.Linear(2, 1))
    return load_policy(network, Sprinter("fell"))


_ENDS = ["fell", "arrived", "out of time", "crashed", "left the road"]


@pytest.fixture(params=[*((end, False) for end in _ENDS), *((end, True) for end in _ENDS[:3])], ids=str)
def robot(request: pytest.FixtureRequest) -> Sprinter:
    end, silent = request.param
    return Sprinter(end, silent=silent)


def test_monitoring_and_walks_end_with_the_episode(robot: Sprinter) -> None:
    (episode,) = monitor_episodes(robot, _policy(), [0], 50)
    assert (episode.steps, episode.ended) == (LAST, robot.end)
    assert measure_walk_lengths(robot, _policy(), [0, 1], 50) == [LAST - 1] * 2
    assert len(collect_start_states(robot, _policy(), 0, 2, at=5)) == 2
    with pytest.raises(Exception, match="expected 1 walks of 25 steps"):
        collect_start_states(robot, _policy(), 0, 1, at=25)


def test_a_roll_out_ends_with_the_episode(robot: Sprinter) -> None:
    (start,) = collect_start_states(robot, _policy(), 0, 1, at=5)
    outcome = run_rollout(robot, _policy(), start, NO_STIMULATION, 50, 5)
    assert (outcome.steps_survived, outcome.outcome) == (LAST - 5, robot.end)


@pytest.mark.parametrize("walk", [5, 50])
def test_a_task_is_judged_on_what_the_episode_has(robot: Sprinter, walk: int) -> None:
    def judge(trace: TaskRunTrace) -> TaskVerdict:
        return TaskVerdict(trace.stays_up(LAST - 5), float(len(trace)), {str(trace.outcome): 1.0})

    task = Task("run", "r", "runs", "any way", (walk, walk), 50, judge)
    (verdict,) = judge_stimulations(robot, _policy(), task, [StimulationWithDuration()], 0)
    if walk > LAST:
        assert verdict == TaskVerdict(False, 0.0, {})
    else:
        assert verdict == TaskVerdict(not is_failure(Outcome(robot.end)), LAST - walk, {robot.end: 1.0})


def test_a_drive_counts_outcomes_and_begins_the_next_episode(robot: Sprinter) -> None:
    text = 'schema = 1\nrobot = "sprinter"\n[policy]\nname = "none"\nsha256 = "none"\n'
    loop = ControlLoop(robot, _policy(), parse_map(text, "test"), 0)
    records = [loop.advance() for _ in range(LAST + 1)]
    assert [record.ended for record in records] == [""] * (LAST - 1) + [robot.end, ""]
    assert [record.outcome for record in records] == [None] * (LAST - 1) + [robot.end, None]
    summary = drive_headless(ControlLoop(robot, _policy(), parse_map(text, "test"), 0), {}, 45, None)
    assert summary.outcomes == {Outcome.FELL: 0} | {Outcome(robot.end): 2}


def test_training_starts_over_and_scores_failures_and_arrivals(robot: Sprinter) -> None:
    pytest.importorskip("jax", reason="the extra 'train' is not installed")
    from pdtui.training.policy_trainer import score_actor
    from pdtui.training.robot_batch import RobotBatch

    def make() -> Sprinter:
        return Sprinter(robot.end, silent=robot.silent)

    worlds = RobotBatch(make, 1, 0)
    rows = [(worlds.step(np.zeros((1, 1), np.float32)), bool(worlds.restarted[0])) for _ in range(LAST + 1)]
    assert [restarted for _, restarted in rows] == [False] * (LAST - 1) + [True, False]
    assert rows[LAST - 1][0].discount == (1.0 if robot.end == "out of time" else 0.0)
    score = score_actor([make()], lambda seen: np.zeros((len(seen), 1), np.float32), range(2), 50)
    assert score.mean_return == LAST
    assert score.falls == (2 if is_failure(Outcome(robot.end)) else 0)
    assert score.arrivals == (2 if robot.end == "arrived" else 0)


class GoalWorld(gymnasium.Env[Floats, Any]):
    """An environment that reports success as many do: it terminates with ``is_success``."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float64)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self) -> None:
        self.steps = 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.steps = 0
        return np.zeros(1), {}

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        del action
        assert self.steps < 3, "stepped past the end of its episode"
        self.steps += 1
        return np.zeros(1), 0.0, self.steps == 3, False, {"is_success": self.steps == 3}


def test_an_environments_success_is_no_fall() -> None:
    gymnasium.register("pdtui-test/Goal-v0", lambda **_: GoalWorld())
    robot = PlainGymnasiumRobot("goal", environment="pdtui-test/Goal-v0")
    robot.reset(seed=0)
    infos = [robot.step(np.zeros(1, np.float32))[4] for _ in range(3)]
    assert [info.get("outcome") for info in infos] == [None, None, "arrived"]
    snapshot = robot.snapshot()
    assert snapshot.memory is not None  # found to be restorable although its episodes end after three steps


class _Sayer(Sprinter):
    """Says a word in every control step."""

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        *result, _ = super().step(action)
        return (*result, {"cost": 0.0, "outcome": self.end})  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("word", "complaint"),
    [
        ("exploded", r"sprinter: 'outcome' .* expected one of 'arrived', 'fell', .* found 'exploded'"),
        ("crashed", "expected 'arrived' or nothing while the episode goes on, found 'crashed'"),
    ],
)
def test_a_word_that_is_no_outcome_is_refused(word: str, complaint: str) -> None:
    text = 'schema = 1\nrobot = "sprinter"\n[policy]\nname = "none"\nsha256 = "none"\n'
    loop = ControlLoop(_Sayer(word), _policy(), parse_map(text, "test"), 0)
    with pytest.raises(RobotError, match=complaint):
        loop.advance()


def test_an_episode_arrives_once_and_may_go_on() -> None:
    text = 'schema = 1\nrobot = "sprinter"\n[policy]\nname = "none"\nsha256 = "none"\n'
    loop = ControlLoop(_Sayer("arrived"), _policy(), parse_map(text, "test"), 0)
    records = [loop.advance() for _ in range(LAST + 1)]
    ended, following = Outcome.OUT_OF_TIME, Outcome.ARRIVED
    assert [record.outcome for record in records] == ["arrived", *[None] * (LAST - 2), ended, following]
    # A rewind to before the arrival arrives again, one to after it does not.
    again = [loop.advance([DriveEvent(loop.step, "rewind", value=step)]).outcome for step in (0, 10)]
    assert again == ["arrived", None]
