"""The experiments' figures against an independent computation."""

from __future__ import annotations

import multiprocessing
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console
from scipy import stats

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import confidence_interval
from pdtui.core.errors import MapError, WorkerError
from pdtui.core.text_tables import format_mean_with_interval
from pdtui.core.units import Stimulation
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import STEPS, evaluate_behaviors, run_behavior_episode
from pdtui.evaluation.evaluation_tables import tracking_table
from pdtui.evaluation.policy_evaluation import evaluate_policy
from pdtui.evaluation.target_tracking import evaluate_target_tracking, find_pid_behaviors
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.deadline import deadline
from tests.turning_robot import Vehicle, turning_loop


@pytest.fixture(scope="module")
def config(small_map: StimulationMap) -> DriveConfig:
    return DriveConfig("ant", small_map, 0)


def _mean_vy(policy: Policy, seed: int, pushed: bool) -> float:
    """A plain loop: 400 steps, stimulated from step 100 on, the last 200 count."""
    robot = make_robot("ant")
    observation, _ = robot.reset(seed=seed)
    vy = []
    for step in range(400):
        stimulation = Stimulation((3, 16 + 7), (-2.0, 2.0)) if pushed and step >= 100 else Stimulation()
        observation, _, terminated, _, _ = robot.step(policy.act(observation, stimulation).action)
        assert not terminated
        vy.append(robot.read_attributes()[robot.attribute_index("vy")])
    return float(np.mean(vy[-200:]))


def test_effects_are_paired_differences_over_the_last_200_steps(config: DriveConfig, policy: Policy) -> None:
    seeds = [100, 101, 102]
    result = evaluate_behaviors(config, seeds).behaviors[0]
    if result.falls or result.default_falls:
        pytest.fail("the untrained policy was chosen to stay up on these seeds")
    pushed = np.array([_mean_vy(policy, seed, True) for seed in seeds])
    default = np.array([_mean_vy(policy, seed, False) for seed in seeds])
    assert result.effect == pytest.approx((pushed - default).mean())
    assert result.value == pytest.approx(pushed.mean())
    assert result.default == pytest.approx(default.mean())
    assert result.right_sign == int(((pushed > 0) & (pushed > default)).sum())
    assert result.measure == "vy (m/s), wanted > 0"


def test_the_number_of_workers_changes_nothing(config: DriveConfig) -> None:
    assert evaluate_behaviors(config, [100, 101], workers=1) == evaluate_behaviors(
        config, [100, 101], workers=2
    )


def test_a_killed_worker_ends_an_evaluation(config: DriveConfig) -> None:
    def kill_one(_done: int, _total: int) -> None:
        multiprocessing.active_children()[0].kill()

    with deadline(60), pytest.raises(WorkerError, match="evaluation of ant: .*killed by SIGKILL"):
        evaluate_behaviors(config, range(100, 110), workers=2, progress=kill_one)


def test_the_interval_is_students() -> None:
    values = np.array([0.1, 0.4, 0.2, 0.9, 0.5])
    expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert confidence_interval(values) == pytest.approx((expected.low, expected.high))
    assert confidence_interval(values[:1]) == (float("-inf"), float("inf"))


class _Tipping(Vehicle):
    """Tips over in a given control step of each episode."""

    def __init__(self, step: int) -> None:
        super().__init__()
        self.tips_in, self.steps = step, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        self.steps = 0
        return super().reset(seed=seed, options=options)

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        self.steps += 1
        observation, reward, _, truncated, info = super().step(action)
        return observation, reward, self.steps == self.tips_in, truncated, info


@pytest.mark.parametrize(("step", "fell"), [(STEPS - 1, True), (STEPS, True), (STEPS + 1, False)])
def test_a_fall_counts_up_to_the_last_step(step: int, fell: bool) -> None:
    standing = turning_loop()
    loop = ControlLoop(_Tipping(step), standing.policy, standing.map, 0)
    assert run_behavior_episode(loop, "turn", 1).fell == fell
    assert run_behavior_episode(loop, "", 1).fell == fell


def test_one_seed_gives_a_mean_without_an_interval(config: DriveConfig) -> None:
    result = evaluate_target_tracking(config, "yaw", [100], targets=(0.5,))
    console = Console(width=120)
    with console.capture() as shown:
        console.print(tracking_table(result))
    assert "inf" not in shown.get()
    assert f"{result.error:.3f}" in shown.get()
    assert format_mean_with_interval(1.0, 0.5, 1.25) == "1.00 [0.50, 1.25]"
    assert format_mean_with_interval(1.0, float("-inf"), float("inf"), "+.1f") == "+1.0"


def test_tracking_measures_the_wrapped_error(config: DriveConfig) -> None:
    result = evaluate_target_tracking(config, "yaw", [100], targets=(0.5,))
    loop = make_robot("ant")
    assert result.unit == "rad"
    assert loop.attributes[loop.attribute_index("yaw")].wraps
    assert 0.0 <= result.error <= np.pi
    assert result.targets[0].error == pytest.approx(result.error)
    assert [one.name for one in find_pid_behaviors(config, "yaw")] == ["hold heading"]
    with pytest.raises(MapError, match="no behavior of mode pid holds 'speed'; held are: yaw"):
        find_pid_behaviors(config, "speed")


def test_walking_sums_up_whole_episodes(config: DriveConfig, policy: Policy) -> None:
    result = evaluate_policy(config, [100], steps=50)
    robot = make_robot("ant")
    observation, _ = robot.reset(seed=100)
    start, speeds, total = robot.read_poses()[0, :2], [], 0.0
    for _ in range(50):
        observation, reward, *_ = robot.step(policy.act(observation).action)
        total += float(reward)
        speeds.append(robot.read_attributes()[robot.attribute_index("speed")])
    assert result.mean_return == pytest.approx(total)
    assert result.mean_speed == pytest.approx(np.mean(speeds))
    assert result.net_speed == pytest.approx(np.linalg.norm(robot.read_poses()[0, :2] - start) / 2.5)
    assert result.finished == 1
