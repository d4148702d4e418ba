"""The experiments' figures against an independent computation."""

from __future__ import annotations

import multiprocessing
import os
import signal
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy import stats

from pdtui.core.confidence_intervals import confidence_interval
from pdtui.core.console.text_tables import format_mean_with_interval
from pdtui.core.errors import MapError, WorkerError
from pdtui.core.outcome import Outcome
from pdtui.core.printable_text import to_json
from pdtui.core.processes.process_start import start_process
from pdtui.core.units import Stimulation
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import MapEvaluation, evaluate_behaviors, plan_evaluation
from pdtui.evaluation.behavior_tables import behavior_tables
from pdtui.evaluation.disturbance_conditions import CONDITIONS
from pdtui.evaluation.evaluation_tables import tracking_table
from pdtui.evaluation.paired_statistics import holm_correction
from pdtui.evaluation.policy_evaluation import evaluate_policy
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.evaluation.target_tracking import evaluate_target_tracking, find_pid_behaviors
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.stimulation_map import MeasuredEffect, StimulationMap
from tests.deadline import deadline


@pytest.fixture(scope="module")
def config(small_map: StimulationMap) -> DriveConfig:
    return DriveConfig("ant", small_map, 0)


SMALL = ProtocolSettings(
    first_press=20,
    presses=10,
    hold_steps=40,
    hold_seconds=0.0,
    window_seconds=1.0,
    draws=2,
    draw_seeds=1,
    condition_seeds=2,
)


def _mean_vy(policy: Policy, seed: int, pushed: bool) -> tuple[float, float]:
    """A plain loop; the first and the last second of the hold."""
    robot = make_robot("ant")
    observation, _ = robot.reset(seed=seed)
    press = 20 + int(np.random.default_rng((1, seed)).integers(10))
    vy = []
    for step in range(press + 60):
        held = pushed and press <= step < press + 40
        stimulation = Stimulation((3, 16 + 7), (-2.0, 2.0)) if held else Stimulation()
        observation, _, terminated, _, _ = robot.step(policy.act(observation, stimulation).action)
        assert not terminated
        vy.append(robot.read_attributes()[robot.attribute_index("vy")])
    return float(np.mean(vy[press : press + 20])), float(np.mean(vy[press + 20 : press + 40]))


@pytest.fixture(scope="module")
def result(config: DriveConfig) -> MapEvaluation:
    return evaluate_behaviors(config, plan_evaluation(config, [100, 101, 102], SMALL), workers=2)


def test_effects_are_paired_differences_while_the_behavior_is_held(
    result: MapEvaluation, policy: Policy
) -> None:
    row = result.behaviors[0]
    pushed, default = (
        np.array([_mean_vy(policy, seed, on) for seed in result.seeds]) for on in (True, False)
    )
    for window, part in ((row.first, 0), (row.last, 1)):
        assert window.effect == pytest.approx((pushed - default)[:, part].mean())
        assert window.value == pytest.approx(pushed[:, part].mean())
        assert window.default == pytest.approx(default[:, part].mean())
        assert window.low <= window.effect <= window.high
        assert window.p_value >= 2 / 2**3
    assert row.outcomes == row.default_outcomes == {Outcome.FELL: 0}
    assert not row.holds  # three seeds cannot tell
    assert (row.attribute, row.unit, row.condition) == ("vy", "m/s", "undisturbed")
    assert result.measured_effects()["push"] == MeasuredEffect(
        row.last.effect, row.last.low, row.last.high, 0, 3
    )


def test_every_condition_and_every_substitute_has_its_figures(result: MapEvaluation) -> None:
    assert [row.condition for row in result.behaviors] == [one.name for one in CONDITIONS]
    assert [row.runs for row in result.behaviors] == [3, *[2] * 8]
    first, *others = result.behaviors
    assert not any(row.substitutes for row in others)
    kinds = [(one.kind, one.draws, one.seeds) for one in first.substitutes]
    assert kinds == [("random units", 2, 1), ("random directions", 2, 1), ("actions", 1, 1)]
    assert result.not_offered == ()
    disturbed = [row.last.p_value for row in others]
    assert [row.last.corrected for row in others] == pytest.approx(holm_correction(disturbed))


def test_the_steps_that_are_announced_are_run(config: DriveConfig, result: MapEvaluation) -> None:
    # 6 measuring runs, 6 undisturbed, 2 × 2 × 8 disturbed and 5 substitutes.
    plan = plan_evaluation(config, [100, 101, 102], SMALL)
    assert [len(plan.measuring_runs()), len(plan.held_runs())] == [6, 6 + 32 + 5]
    press = [20 + int(np.random.default_rng((1, seed)).integers(10)) for seed in (100, 101, 102)]
    runs = [2 + 2 * 8 + 5, 2 + 2 * 8, 2]
    held = sum(count * (start + 60) for count, start in zip(runs, press, strict=True))
    assert result.control_steps == held + 2 * sum(start + 20 for start in press)


def test_the_tables_show_the_criterion_and_what_is_not_offered(result: MapEvaluation) -> None:
    console = Console(width=200)
    with console.capture() as shown:
        console.print(behavior_tables(replace(result, not_offered=("pushed",), nearly_one_start=True)))
    text = shown.get()
    assert "course within 45° of +y in the last 5 s" in text
    assert "Not offered by ant: pushed." in text
    assert "These 3 seeds are nearly one start" in text


def test_the_number_of_workers_changes_nothing(config: DriveConfig, result: MapEvaluation) -> None:
    alone = evaluate_behaviors(config, plan_evaluation(config, [100, 101, 102], SMALL), workers=1)
    assert to_json(asdict(alone)) == to_json(asdict(result))


def _evaluate_half(config: DriveConfig, journal: Path) -> None:
    """Evaluate until this process kills itself."""

    def kill(done: int, total: int) -> None:
        if done > total // 2:
            os.kill(os.getpid(), signal.SIGKILL)

    evaluate_behaviors(
        config, plan_evaluation(config, [100, 101, 102], SMALL), journal=journal, progress=kill
    )


def test_a_killed_evaluation_goes_on_and_finds_the_same(
    config: DriveConfig, result: MapEvaluation, tmp_path: Path
) -> None:
    journal = tmp_path / "runs.jsonl"
    process = start_process("evaluation", "pdtui.driving.drive_process", _evaluate_half, config, journal)
    process.join()
    assert process.exitcode == -signal.SIGKILL
    kept = journal.read_bytes()
    plan = plan_evaluation(config, [100, 101, 102], SMALL)
    runs = len(plan.measuring_runs()) + len(plan.held_runs())
    assert kept.count(b"\n") == runs // 2 + 1
    told: list[int] = []
    again = evaluate_behaviors(config, plan, journal=journal, progress=lambda done, _total: told.append(done))
    assert to_json(asdict(again)) == to_json(asdict(result))
    assert journal.read_bytes().startswith(kept)
    assert journal.read_bytes().count(b"\n") == runs
    assert told[-1] == runs
    other = plan_evaluation(config, [103], replace(SMALL, draws=0, condition_seeds=0))
    evaluate_behaviors(config, other, journal=journal)
    assert journal.read_bytes().count(b"\n") > runs  # of another seed, nothing was known


def test_a_killed_worker_ends_an_evaluation(config: DriveConfig) -> None:
    def kill_one(_done: int, _total: int) -> None:
        multiprocessing.active_children()[0].kill()

    plan = plan_evaluation(config, range(100, 110), SMALL)
    with deadline(60), pytest.raises(WorkerError, match="evaluation of ant: .*killed by SIGKILL"):
        evaluate_behaviors(config, plan, workers=2, progress=kill_one)


def test_the_interval_is_students() -> None:
    values = np.array([0.1, 0.4, 0.2, 0.9, 0.5])
    expected = stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert confidence_interval(values) == pytest.approx((expected.low, expected.high))
    assert confidence_interval(values[:1]) == (float("-inf"), float("inf"))


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
    assert result.outcomes == {Outcome.FELL: 0, Outcome.OUT_OF_TIME: 1}
