"""The paper authors' weights load, have the right shapes, and give the numbers of their own formulas."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from gymnasium.spaces import Box
from numpy.typing import NDArray

from pdtui.cli import main
from pdtui.core.attributes import Floats
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.policies.weights.import_options import ImportOptions, ObservationActionSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.unit_selection import choose_primitive_candidates
from pdtui.robots import make_robot
from pdtui.robots.ant import Ant
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset

Reference = Callable[[str], Path]
Draw = Callable[[int], NDArray[np.float32]]
ANT = ObservationActionSpaces("Ant with contact forces", 111, 8, (-1.0,) * 8, (1.0,) * 8)


def _forward(
    x: NDArray[np.float64], layers: list[tuple[NDArray[np.float64], NDArray[np.float64]]], elu: bool
) -> NDArray[np.float64]:
    for weight, bias in layers[:-1]:
        x = weight @ x + bias
        x = np.where(x > 0, x, np.expm1(x)) if elu else np.tanh(x)
    weight, bias = layers[-1]
    return weight @ x + bias


def _layers(path: Path, names: list[str]) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    with np.load(path, allow_pickle=False) as arrays:
        return [
            (arrays[f"{n}.weight"].astype(float), arrays[f"{n}.bias"].astype(float))
            if f"{n}.weight" in arrays
            else (arrays[f"{n}/kernel"].T.astype(float), arrays[f"{n}/bias"].astype(float))
            for n in names
        ]


def test_the_ant_is_an_rllib_sac(reference: Reference, observations: Draw) -> None:
    path = reference("ant.npz")
    policy = load_policy(path, import_options=ImportOptions("tanh"), spaces=ANT)
    assert (policy.shape, policy.layers) == ((111,), (256, 256))
    layers = _layers(path, [f"default_policy/sequential/action_{name}" for name in ("1", "2", "out")])
    for observation in observations(111):
        expected = np.tanh(_forward(observation.astype(float), layers, elu=False)[:8])
        np.testing.assert_allclose(policy.act(observation).action, expected, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "observed", "widths", "activation"),
    [
        ("anymal_forward_tanh.npz", 47, (128, 64, 32), "tanh"),
        ("anymal_tanh.npz", 49, (128, 64, 32), "tanh"),
        ("forward_cassie_elu.npz", 170, (512, 256, 128), "elu"),
    ],
)
def test_rsl_rl_weights(
    name: str,
    observed: int,
    widths: tuple[int, ...],
    activation: str,
    reference: Reference,
    observations: Draw,
) -> None:
    path = reference(name)
    policy = load_policy(path, import_options=ImportOptions(activation))
    assert (policy.shape, policy.layers) == ((observed,), widths)
    layers = _layers(path, [f"actor.{number}" for number in (0, 2, 4, 6)])
    for observation in observations(observed):
        expected = _forward(observation.astype(float), layers, elu=activation == "elu")
        np.testing.assert_allclose(policy.act(observation).action, expected, rtol=1e-4, atol=1e-4)
    with np.load(path) as arrays:
        spread = arrays["std"]
    rng = np.random.default_rng(0)
    drawn = np.array([policy.act(observation, rng=rng).action for _ in range(2000)])
    np.testing.assert_allclose(drawn.std(0), spread, rtol=0.12)


def test_the_a1_is_a_plain_chain_with_statistics(reference: Reference, observations: Draw) -> None:
    path, statistics = reference("quadrupedal.npz"), reference("quadrupedal_obs_normalizer.npz")
    import_options = ImportOptions("tanh", "tanh", str(statistics))
    policy = load_policy(
        path,
        import_options=import_options,
        spaces=ObservationActionSpaces("A1", 93, 6, (-1.0,) * 6, (1.0,) * 6),
    )
    assert (policy.shape, policy.layers) == ((93,), (256,) * 4)
    names = ["base.seq_fcs.0", "base.seq_fcs.2", *(f"seq_append_fcs.{number}" for number in (0, 2, 4))]
    layers = _layers(path, names)
    with np.load(statistics) as arrays:
        mean, std = arrays["mean"], np.sqrt(arrays["var"] + 1e-8)
    for draw in observations(93):
        # Around the statistics' own mean: the A1's first three numbers hardly vary.
        observation = mean + draw * std
        expected = np.tanh(_forward(draw.astype(float), layers, elu=False))
        np.testing.assert_allclose(policy.act(observation).action, expected, atol=2e-3)


@pytest.mark.slow
def test_the_authors_brake_brakes(reference: Reference) -> None:
    """Unit 0:156 at −20 stops their Ant from 5 m/s (20 seeds); it observes 84 zeros as contact forces.

    Braked at full speed, some rear up beyond the height at which an episode ends; the simulation goes on
    here, because the claim is about where the brake leads, and counts them.
    """
    policy = load_policy(reference("ant.npz"), import_options=ImportOptions("tanh"), spaces=ANT)
    robot = make_robot("ant")
    speed = robot.attribute_index("speed")

    def run(seed: int, stimulation: Stimulation) -> tuple[float, bool]:
        """Mean speed of the last 100 of 300 steps, stimulated from the 100th on; whether it fell."""
        observation, _ = robot.reset(seed=seed)
        speeds: list[float] = []
        fallen = False
        for step in range(300):
            padded = np.concatenate([observation, np.zeros(84)])
            acted = policy.act(padded, stimulation if step >= 100 else NO_STIMULATION)
            observation, _, fell, _, _ = robot.step(acted.action)
            fallen = fallen or fell
            speeds.append(float(robot.read_attributes()[speed]))
        return float(np.mean(speeds[-100:])), fallen

    free = [run(seed, NO_STIMULATION) for seed in range(20)]
    braked = [run(seed, Stimulation((156,), (-20.0,))) for seed in range(20)]
    print(
        f"unperturbed {np.mean([s for s, _ in free]):.2f} m/s, {sum(f for _, f in free)} falls; "
        f"braked {np.mean([s for s, _ in braked]):.3f} m/s, at most {max(s for s, _ in braked):.3f}, "
        f"{sum(f for _, f in braked)} falls"
    )
    assert np.mean([s for s, _ in free]) > 4.5
    assert not any(fell for _, fell in free)
    assert max(s for s, _ in braked) < 0.3
    assert sum(fell for _, fell in braked) <= 7


def test_the_authors_bipedal_walker_walks_with_stock_motors(reference: Reference) -> None:
    """Its motors give 80 N m; with the robot's usual 300 it falls in one episode of three."""
    path = reference("bipedal_walker.npz")
    if not path.exists():
        pytest.skip(f"{path}, the authors' weights, is not here")
    arguments = ["evaluate", "bipedal_walker", "--policy", str(path), "--activation", "tanh", "--policy-only"]
    result = CliRunner().invoke(
        main, [*arguments, "--robot-option", "torque=80", "--seeds", "100-101", "--json"]
    )
    assert result.exit_code == 0, result.output
    alone = json.loads(result.stdout)
    assert alone["finished"] == 2
    assert alone["mean_return"] > 290


class _PaddedAnt(Ant):
    """The Ant as their policy observes it: with 84 zeros for contact forces."""

    def __init__(self) -> None:
        super().__init__(forward="x")
        self.observation_space = Box(-np.inf, np.inf, (111,), np.float64)

    def observe(self) -> Floats:
        return np.concatenate([super().observe(), np.zeros(84)])


@pytest.mark.slow
def test_probing_sees_the_authors_brake_and_how_common_brakes_are(reference: Reference) -> None:
    """Probed like any unit, 0:156 brakes from every start; at such outputs many do, so it is not rare."""
    policy = load_policy(reference("ant.npz"), import_options=ImportOptions("tanh"), spaces=ANT)
    others = np.random.default_rng(0).choice(512, 63, replace=False).tolist()
    units = sorted({156, *others})
    with RolloutPool(_PaddedAnt(), policy, 1) as pool:
        speed = pool.robot.attribute_index("speed")
        starts = collect_start_states(pool.robot, policy, 1102, 4, at=100)
        sweep = EffectProbe(pool).measure_units(units, (-20.0, -8.0), starts, steps=80)
    change = np.nan_to_num(sweep.effects[..., speed])
    row = units.index(156)
    brakes = np.asarray(np.all(change < -0.5 * sweep.unperturbed[:, speed], axis=2))
    print(
        f"0:156 at −8: {change[row, 1].round(2)} m/s of {sweep.unperturbed[:, speed].round(2)}; "
        f"of {len(units)} units, {brakes[:, 1].sum()} take half of it at −8 and {brakes[:, 0].sum()} at −20"
    )
    assert brakes[row, 1]
    assert not sweep.falls[row, 1].any()
    assert sweep.robust_effects(speed, -1.0)[row, 1] > 2.0


@pytest.mark.slow
def test_the_smallest_dose_does_not_single_out_the_authors_brake(reference: Reference) -> None:
    """Many of the 512 units stop their Ant at ±2, where 0:156 does little: it brakes at ±8, as most do."""
    policy = load_policy(reference("ant.npz"), import_options=ImportOptions("tanh"), spaces=ANT)
    values = (-8.0, -4.0, -2.0, 2.0, 4.0, 8.0)
    with RolloutPool(_PaddedAnt(), policy, 1) as pool:
        speed = pool.robot.attribute_index("speed")
        episodes = monitor_episodes(pool.robot, policy, [1000, 1001], 300)
        matching = match_units(episodes, pool.robot.attributes, find_matching_preset("paper", []))
        starts = collect_start_states(pool.robot, policy, 1102, 2, at=range(50, 101))
        screen = EffectProbe(pool).measure_units(range(512), values, starts, steps=60)
    candidates = choose_primitive_candidates(screen, screen, matching, [speed], values, 512)
    braking = [one for one in candidates if one.sign < 0.0]
    place = next(number for number, one in enumerate(braking, 1) if one.unit == 156)
    halved = screen.robust_effects(speed, -1.0) > 0.5 * screen.unperturbed[:, speed].mean()
    print(
        f"0:156 is number {place} of {len(braking)} brakes, at {braking[place - 1].value:g}; first are "
        f"{[(one.unit, one.value) for one in braking[:5]]}; units that take half of the speed, by output: "
        f"{dict(zip(values, halved.sum(axis=0).tolist(), strict=True))}"
    )
    assert halved[156, [0, 5]].all()
    assert not halved[156, 1:5].any()
    assert halved[:, 2:4].any(axis=1).sum() >= 40
    assert place > 100
