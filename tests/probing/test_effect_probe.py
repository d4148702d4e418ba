from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import PolicyError, RobotError
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import StartState, collect_start_states
from pdtui.probing.stimulated_rollout import PidStimulationPlan
from pdtui.stimulation.stimulation_map import PidGains
from tests.wired_policy import WIRED_MOTOR, WIRED_UNIT

FIRST_TORQUE = 8


@pytest.fixture(scope="module")
def starts(policy_file: Path) -> list[StartState]:
    with RolloutPool("ant", policy_file, 1) as pool:
        return collect_start_states(pool.robot, pool.policy, 1000, 3, at=20)


def test_nothing_stimulated_changes_nothing(policy_file: Path, starts: list[StartState]) -> None:
    with RolloutPool("ant", policy_file, 1) as pool:
        result = EffectProbe(pool).measure_plans([NO_STIMULATION], starts, steps=30)
    np.testing.assert_array_equal(result.effects, 0.0)
    assert not result.falls.any()


def test_effects_are_those_of_a_roll_out_done_by_hand(policy_file: Path, starts: list[StartState]) -> None:
    plan = Stimulation((3, 12), (2.0, -1.5))
    with RolloutPool("ant", policy_file, 1) as pool:
        result = EffectProbe(pool).measure_plans([plan], starts, steps=20, measure_from=12)
        robot, policy = pool.robot, pool.policy
        means = []
        for stimulation in (plan, NO_STIMULATION):
            robot.restore(starts[1].snapshot)
            observation, rows = robot.observe(), []
            for _ in range(20):
                observation, *_ = robot.step(policy.act(observation, stimulation).action)
                rows.append(robot.read_attributes())
            means.append(np.mean(rows[12:], axis=0))
        plain = [not attribute.wraps for attribute in robot.attributes]
    np.testing.assert_allclose(result.effects[0, 1, plain], (means[0] - means[1])[plain], atol=1e-12)


def test_the_number_of_workers_does_not_matter(policy_file: Path, starts: list[StartState]) -> None:
    plans = [Stimulation((unit,), (value,)) for unit in (0, 5, 11) for value in (-3.0, 3.0)]
    results = []
    for workers in (1, 2):
        with RolloutPool("ant", policy_file, workers) as pool:
            seen: list[tuple[int, int]] = []

            def note(done: int, of: int, seen: list[tuple[int, int]] = seen) -> None:
                seen.append((done, of))

            results.append(EffectProbe(pool).measure_plans(plans, starts, steps=30, progress=note))
        assert seen[-1] == (21, 21)
    np.testing.assert_array_equal(results[0].effects, results[1].effects)
    np.testing.assert_array_equal(results[0].falls, results[1].falls)


def test_a_wired_unit_is_found_with_its_sign(wired_file: Path) -> None:
    with RolloutPool("ant", wired_file, 1) as pool:
        starts = collect_start_states(pool.robot, pool.policy, 1000, 2, at=5)
        sweep = EffectProbe(pool).measure_units(range(pool.policy.units), (-3.0, 3.0), starts, steps=20)
        unit = pool.policy.layers[0] + WIRED_UNIT
        column = FIRST_TORQUE + WIRED_MOTOR
        scale = pool.robot.attributes[column].scale
    last_layer = np.array(sweep.units) >= 8
    strength = sweep.robust_strengths(column)
    assert sweep.units[int(np.argmax(strength))] == unit
    # Of the last layer no other unit reaches any motor; its head weight is 0.2 and |v| is 3.
    assert (strength[last_layer & (np.array(sweep.units) != unit)] == 0).all()
    row = sweep.units.index(unit)
    unstimulated = sweep.unperturbed[:, column] * scale
    for dose, value in enumerate(sweep.values):
        np.testing.assert_allclose(
            sweep.effects[row, dose, :, column] * scale, 0.2 * value - unstimulated, atol=1e-6
        )
    assert (sweep.robust_effects(column, 1.0)[row] > 0).tolist() == [False, True]


def test_the_same_start_is_rolled_out_unperturbed_once(policy_file: Path, starts: list[StartState]) -> None:
    with RolloutPool("ant", policy_file, 1) as pool:
        prober = EffectProbe(pool)
        first = prober.measure_plans([Stimulation((0,), (1.0,))], starts, steps=10)
        assert pool.rollouts == 6
        second = prober.measure_plans([Stimulation((0,), (1.0,))], starts[1:], steps=10)
        assert pool.rollouts == 8
    np.testing.assert_array_equal(first.effects[:, 1:], second.effects)


def test_a_fall_before_the_measured_steps_leaves_no_number(
    policy_file: Path, starts: list[StartState]
) -> None:
    with RolloutPool("ant", policy_file, 1) as pool:
        pool.robot.torso_heights = (2.0, 3.0)  # type: ignore[attr-defined]
        result = EffectProbe(pool).measure_plans([Stimulation((0,), (1.0,))], starts, steps=10)
    assert result.falls.all()
    assert np.isnan(result.effects).all()


def test_a_controller_brings_a_torque_to_its_target(wired_file: Path) -> None:
    with RolloutPool("ant", wired_file, 1) as pool:
        starts = collect_start_states(pool.robot, pool.policy, 1000, 2, at=5)
        name = pool.robot.attributes[FIRST_TORQUE + WIRED_MOTOR].name
        pid = PidGains(name, kp=0.002, ki=0.2, kd=0.0, limit=5.0, step=1.0)
        wired = Stimulation((pool.policy.layers[0] + WIRED_UNIT,), (1.0,))
        plans = [PidStimulationPlan(units, pid, 40.0, relative=False) for units in (wired, NO_STIMULATION)]
        result = EffectProbe(pool).measure_plans(plans, starts, steps=40, measure_from=30)
    assert (result.errors[0] < 1.0).all()
    assert (result.errors[1] > 20.0).all()


def test_what_is_wrong_is_raised_where_it_was_asked(policy_file: Path, tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="unknown robot 'cat'"):
        RolloutPool("cat", policy_file)
    with pytest.raises(PolicyError, match="no policy"):
        RolloutPool("ant", tmp_path / "none.safetensors")


def test_a_unit_that_does_not_exist_is_reported_from_a_worker(
    policy_file: Path, starts: list[StartState]
) -> None:
    with RolloutPool("ant", policy_file, 2) as pool, pytest.raises(PolicyError, match="does not exist"):
        EffectProbe(pool).measure_plans([Stimulation((99,), (1.0,))], starts, steps=5)
