from __future__ import annotations

import numpy as np
import pytest

from pdtui.dissection.matching import match
from pdtui.dissection.monitor import Episode
from pdtui.dissection.spectrum import PRESETS, Preset, spectrogram, transform
from pdtui.errors import PolicyError
from pdtui.robots.types import Attribute

ATTRIBUTES = (Attribute("speed", "m/s"), Attribute("torque", "N m", scale=0.1))


def episode(seed: int, steps: int, units: int = 6) -> Episode:
    rng = np.random.default_rng(seed)
    walk = rng.standard_normal((steps, units)).cumsum(axis=0)
    return Episode(seed, np.tanh(walk).astype(np.float32), rng.standard_normal((steps, 2)) * [1.0, 10.0])


@pytest.mark.parametrize("preset", PRESETS.values(), ids=list(PRESETS))
def test_discrepancy_is_the_mean_norm_of_the_difference(preset: Preset) -> None:
    episodes = [episode(1, 200), episode(2, 330)]
    found = match(episodes, ATTRIBUTES, preset)
    for row, attribute in enumerate(ATTRIBUTES):
        for unit in range(6):
            norms = []
            for one in episodes:
                z = spectrogram(transform(one.activations[:, [unit]], preset), preset)
                s = one.attributes[:, [row]] * attribute.scale
                difference = (z - spectrogram(transform(s, preset), preset)).ravel()
                norms.append(np.linalg.norm(difference))
            assert found.discrepancy[row, unit] == pytest.approx(np.mean(norms), rel=1e-12)


def test_a_copy_of_the_attribute_matches_best_and_exactly() -> None:
    one = episode(3, 200)
    one.activations[:, 4] = np.float32(one.attributes[:, 1] * 0.1)
    copied = one.activations[:, 4].astype(np.float64) * 10.0
    exact = Episode(3, one.activations, np.column_stack([one.attributes[:, 0], copied]))
    found = match([exact], ATTRIBUTES, PRESETS["paper"])
    assert found.ranked(1)[0] == 4
    assert found.discrepancy[1, 4] == pytest.approx(0.0, abs=1e-9)
    assert found.discrepancy[1, [0, 1, 2, 3, 5]].min() > 0.1


def test_level_share_tells_a_mean_from_a_movement() -> None:
    time = np.arange(256)
    activations = np.zeros((256, 2), np.float32)
    activations[:, 1] = 0.5
    fast = 0.5 + np.cos(2 * np.pi * 16 * time / 64)
    attributes = np.column_stack([np.full(256, 0.5), fast])
    found = match([Episode(0, activations, attributes)], ATTRIBUTES[:1] * 2, PRESETS["paper"])
    # The constant and the silent unit differ in level only; the wave and the constant only in movement.
    assert found.level_share[0, 0] == pytest.approx(1.0)
    assert found.level_share[1, 1] == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < found.level_share[1, 0] < 1.0


def test_episodes_shorter_than_a_window_are_left_out_and_named() -> None:
    long, short = episode(5, 128), episode(6, 63)
    found = match([long, short], ATTRIBUTES, PRESETS["paper"])
    assert found.used == (5,)
    assert found.skipped == ((6, 63),)
    np.testing.assert_array_equal(found.discrepancy, match([long], ATTRIBUTES, PRESETS["paper"]).discrepancy)


def test_only_short_episodes_are_an_error_that_names_their_length() -> None:
    with pytest.raises(PolicyError, match=r"at least 64 steps .*'paper'.* got 12, 40"):
        match([episode(1, 12), episode(2, 40)], ATTRIBUTES, PRESETS["paper"])


def test_constant_and_broken_attributes_are_marked() -> None:
    one = episode(7, 100)
    one.attributes[:, 0] = 3.0
    one.attributes[50, 1] = np.nan
    found = match([one], ATTRIBUTES, PRESETS["paper"])
    assert found.flaws["speed"].startswith("constant")
    assert found.flaws["torque"] == "not finite in the episodes of seeds [7]; left out"
    assert np.isnan(found.discrepancy[1]).all()
    assert found.ranked(1).size == 0
    assert found.ranked(0).size == 6
