from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute
from pdtui.dissection.steering.linear_probes import WIDEST_LAYER, fit_linear_probes
from pdtui.spectra.episode_monitor import MonitoredEpisode

SPEED, NOISE, HEADING = (
    Attribute("speed", "m/s"),
    Attribute("noise", ""),
    Attribute("heading", "rad", wraps=True),
)
TOLD = np.array([0.0, 2.0, -1.0, 0.0, 0.5])


def _episodes(count: int, steps: int = 120) -> list[MonitoredEpisode]:
    """The second layer, of 5 units, tells the speed; the first, of 3, tells nothing."""
    rng = np.random.default_rng(4)
    found = []
    for seed in range(count):
        idle, telling = rng.normal(size=(steps, 3)), rng.normal(size=(steps, 5))
        speed = 3.0 + telling @ TOLD + 0.01 * rng.normal(size=steps)
        # An angle that was unwrapped, some turns away.
        heading = telling[:, 0] / 3.0 + 2.0 * np.pi * seed
        values = np.column_stack([speed, rng.normal(size=steps), heading])
        outputs = np.concatenate([idle, telling], axis=1).astype(np.float32)
        found.append(MonitoredEpisode(seed, outputs, values))
    return found


def test_a_probe_finds_the_layer_and_the_weights_that_tell_the_attribute() -> None:
    (probe,) = fit_linear_probes(_episodes(4), [SPEED, NOISE, HEADING], (3, 5), [0])
    assert probe.layer == 1
    assert probe.r2 > 0.99
    np.testing.assert_allclose(probe.weights, TOLD, atol=0.01)
    assert probe.intercept == pytest.approx(3.0, abs=0.01)
    assert probe.deviation == pytest.approx(np.linalg.norm(TOLD), rel=0.1)


def test_what_nothing_tells_is_not_predicted_in_other_episodes() -> None:
    (probe,) = fit_linear_probes(_episodes(4), [SPEED, NOISE, HEADING], (3, 5), [1])
    assert probe.r2 < 0.05


def test_angles_are_fitted_within_half_a_turn() -> None:
    (probe,) = fit_linear_probes(_episodes(4), [SPEED, NOISE, HEADING], (3, 5), [2])
    assert probe.r2 > 0.95
    assert abs(probe.weights[0] - 1.0 / 3.0) < 0.02


def test_weights_are_those_of_least_squares_with_a_penalty() -> None:
    episodes = _episodes(3)
    (probe,) = fit_linear_probes(episodes, [SPEED, NOISE, HEADING], (8,), [0])
    x = np.concatenate([one.activations for one in episodes]).astype(np.float64)
    y = np.concatenate([one.attributes[:, 0] for one in episodes])
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    unit = np.linalg.norm(x) ** 2 / x.shape[1]

    def solve(power: int) -> NDArray[np.float64]:
        rows = np.concatenate([x, np.sqrt(10.0**power * unit) * np.eye(8)])
        return np.asarray(np.linalg.lstsq(rows, np.concatenate([y, np.zeros(8)]), rcond=None)[0])

    assert any(np.allclose(probe.weights, solve(power), atol=1e-8) for power in range(-5, 2))


def test_the_difference_of_means_is_of_the_highest_and_the_lowest_third() -> None:
    episodes = _episodes(2)
    (probe,) = fit_linear_probes(episodes, [SPEED, NOISE, HEADING], (8,), [0])
    rows = sorted(
        (
            (speed, row)
            for one in episodes
            for speed, row in zip(one.attributes[:, 0], one.activations, strict=True)
        ),
        key=lambda pair: pair[0],
    )
    third = len(rows) // 3
    low, high = (np.mean([row for _, row in some], axis=0) for some in (rows[:third], rows[-third:]))
    np.testing.assert_allclose(probe.mean_difference, high - low, atol=0.05)


def test_one_episode_is_enough_and_what_never_varies_or_is_too_wide_has_no_probe() -> None:
    (probe,) = fit_linear_probes(_episodes(1), [SPEED, NOISE, HEADING], (3, 5), [0])
    assert probe.r2 > 0.99
    still = MonitoredEpisode(0, np.ones((50, 2), np.float32), np.ones((50, 1)))
    assert fit_linear_probes([still], [SPEED], (2,), [0]) == ()
    wide = MonitoredEpisode(0, np.zeros((4, WIDEST_LAYER + 1), np.float32), np.arange(4.0)[:, None])
    assert fit_linear_probes([wide], [SPEED], (WIDEST_LAYER + 1,), [0]) == ()
