from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.signal import ShortTimeFFT, get_window

from pdtui.core.attributes import Attribute
from pdtui.core.errors import PolicyError
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import PRESETS, MatchingPreset, find_matching_preset
from pdtui.spectra.mean_distances import measure_in_single_precision
from pdtui.spectra.spectrogram import scaled_attribute_series, short_time_transform, spectrogram

ATTRIBUTES = (Attribute("speed", "m/s"), Attribute("torque", "N m", scale=0.1))


def episode(seed: int, steps: int, units: int = 6) -> MonitoredEpisode:
    rng = np.random.default_rng(seed)
    walk = rng.standard_normal((steps, units)).cumsum(axis=0)
    return MonitoredEpisode(
        seed, np.tanh(walk).astype(np.float32), rng.standard_normal((steps, 2)) * [1.0, 10.0]
    )


@pytest.mark.parametrize("preset", PRESETS.values(), ids=list(PRESETS))
def test_discrepancy_is_the_mean_norm_of_the_difference(preset: MatchingPreset) -> None:
    episodes = [episode(1, 200), episode(2, 330)]
    # Six units in blocks of four: the last block is not full.
    found = match_units(episodes, ATTRIBUTES, preset, block=4)
    for row, attribute in enumerate(ATTRIBUTES):
        for unit in range(6):
            norms = []
            for one in episodes:
                z = spectrogram(short_time_transform(one.activations[:, [unit]], preset), preset)
                s = one.attributes[:, [row]] * attribute.scale
                difference = (z - spectrogram(short_time_transform(s, preset), preset)).ravel()
                norms.append(np.linalg.norm(difference))
            assert found.discrepancy[row, unit] == pytest.approx(np.mean(norms), rel=1e-6)


def test_a_copy_of_the_attribute_matches_best_and_exactly() -> None:
    one = episode(3, 200)
    one.activations[:, 4] = np.float32(one.attributes[:, 1] * 0.1)
    copied = one.activations[:, 4].astype(np.float64) * 10.0
    exact = MonitoredEpisode(3, one.activations, np.column_stack([one.attributes[:, 0], copied]))
    found = match_units([exact], ATTRIBUTES, PRESETS["paper"])
    assert found.ranked_units(1)[0] == 4
    assert found.discrepancy[1, 4] == pytest.approx(0.0, abs=1e-9)
    assert found.discrepancy[1, [0, 1, 2, 3, 5]].min() > 0.1


def test_an_offset_moves_the_level_at_which_an_attribute_is_compared() -> None:
    """A unit that observes ``heading / π + 0.5`` is found by this, and not by the heading in rad."""
    heading = np.random.default_rng(4).uniform(-1.0, 1.0, 320)
    activations = np.stack([heading / np.pi, heading / np.pi + 0.5], axis=1).astype(np.float32)
    heading = (activations[:, 1].astype(np.float64) - 0.5) * np.pi
    one = MonitoredEpisode(4, activations, np.column_stack([heading, heading]))
    scaled = Attribute("heading", "rad", scale=1 / np.pi)
    observed = Attribute("heading", "rad", scale=1 / np.pi, offset=0.5)
    for preset in (PRESETS["paper"], PRESETS["authors"]):
        found = match_units([one], (scaled, observed), preset)
        assert found.discrepancy[:, [0, 1]].argmin(axis=1).tolist() == [0, 1]
        by_hand = MonitoredEpisode(4, activations, np.stack([heading / np.pi, heading / np.pi + 0.5], axis=1))
        expected = by_scipy(by_hand, (Attribute("a", ""), Attribute("b", "")), preset)
        np.testing.assert_allclose(found.discrepancy, expected, rtol=1e-9, atol=1e-12)


def test_without_an_offset_no_bit_changes() -> None:
    values = np.array([[-0.0, 0.1], [0.0, -7.0]])
    for attribute in ATTRIBUTES:
        assert attribute.as_observed(values).tobytes() == (values * attribute.scale).tobytes()


def test_level_share_tells_a_mean_from_a_movement() -> None:
    time = np.arange(256)
    activations = np.zeros((256, 2), np.float32)
    activations[:, 1] = 0.5
    fast = 0.5 + np.cos(2 * np.pi * 16 * time / 64)
    attributes = np.column_stack([np.full(256, 0.5), fast])
    found = match_units([MonitoredEpisode(0, activations, attributes)], ATTRIBUTES[:1] * 2, PRESETS["paper"])
    # The constant and the silent unit differ in level only; the wave and the constant only in movement.
    assert found.level_share[0, 0] == pytest.approx(1.0)
    assert found.level_share[1, 1] == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < found.level_share[1, 0] < 1.0


def test_episodes_shorter_than_a_window_are_left_out_and_named() -> None:
    long, short = episode(5, 128), episode(6, 63)
    found = match_units([long, short], ATTRIBUTES, PRESETS["paper"])
    assert found.used == (5,)
    assert found.skipped == ((6, 63),)
    np.testing.assert_array_equal(
        found.discrepancy, match_units([long], ATTRIBUTES, PRESETS["paper"]).discrepancy
    )


def test_only_short_episodes_are_an_error_that_names_their_length() -> None:
    with pytest.raises(PolicyError, match=r"at least 64 steps .*'paper'.* got 12, 40"):
        match_units([episode(1, 12), episode(2, 40)], ATTRIBUTES, PRESETS["paper"])


def test_constant_and_broken_attributes_are_marked() -> None:
    one = episode(7, 100)
    one.attributes[:, 0] = 3.0
    one.attributes[50, 1] = np.nan
    found = match_units([one], ATTRIBUTES, PRESETS["paper"])
    assert found.flaws["speed"].startswith("constant")
    assert found.flaws["torque"] == "not finite in the episodes of seeds [7]; left out"
    assert np.isnan(found.discrepancy[1]).all()
    assert found.ranked_units(1).size == 0
    assert found.ranked_units(0).size == 6


def by_scipy(one: MonitoredEpisode, attributes: Sequence[Attribute], preset: MatchingPreset) -> np.ndarray:
    """Discrepancies of one episode, pair by pair, from another library's transform."""
    first = -(-(preset.length // 2) // preset.hop)
    whole = (one.steps - preset.length) // preset.hop + 1
    taper = get_window(preset.window, preset.length)
    frames = ShortTimeFFT(taper, preset.hop, fs=1.0, scale_to="magnitude", phase_shift=None)

    def spectra(series: np.ndarray) -> np.ndarray:
        magnitude = np.abs(frames.stft(series.astype(float), p0=first, p1=first + whole))
        return magnitude**2 if preset.spectrogram == "power" else magnitude

    scaled = [spectra(one.attributes[:, j] * attribute.scale) for j, attribute in enumerate(attributes)]
    units = [spectra(series) for series in one.activations.T]
    return np.array([[np.linalg.norm(z - s) for z in units] for s in scaled])


@pytest.mark.parametrize("preset", PRESETS.values(), ids=list(PRESETS))
@pytest.mark.parametrize("block", [1, 7, 64])
def test_the_ranking_is_that_of_a_loop_over_another_library(preset: MatchingPreset, block: int) -> None:
    one = episode(11, 400, units=130)
    found = match_units([one], ATTRIBUTES, preset, block=block)
    expected = by_scipy(one, ATTRIBUTES, preset)
    np.testing.assert_allclose(found.discrepancy, expected, rtol=1e-6)
    for row in range(2):
        np.testing.assert_array_equal(found.ranked_units(row), np.argsort(expected[row]))


def test_a_near_copy_of_a_loud_attribute_keeps_its_digits() -> None:
    rng = np.random.default_rng(12)
    attribute = 1000.0 + rng.standard_normal((300, 1))
    attribute = attribute.astype(np.float32).astype(np.float64)
    activations = (attribute + np.array([0.0, 0.001, 0.002, 5.0])).astype(np.float32)
    loud = (Attribute("loud", "m"),)
    found = match_units([MonitoredEpisode(0, activations, attribute)], loud, PRESETS["authors"])
    np.testing.assert_allclose(
        found.discrepancy[0, 1:],
        by_scipy(MonitoredEpisode(0, activations, attribute), loud, PRESETS["authors"])[0, 1:],
        rtol=1e-8,
    )
    assert found.discrepancy[0, 0] == 0.0


def test_units_that_never_fire_stand_still_or_break_are_marked() -> None:
    one, other = episode(13, 100), episode(14, 100)
    for each in (one, other):
        each.activations[:, 1] = 0.0
        each.activations[:, 2] = 0.75
    one.activations[:, 3] = 0.0
    other.activations[20, 4] = np.nan
    found = match_units([one, other], ATTRIBUTES, PRESETS["paper"], block=4)
    assert found.unit_flaws == {
        1: "never fires",
        2: "constant in every episode; only its level can match",
        4: "not finite; left out",
    }
    assert np.isnan(found.discrepancy[:, 4]).all()
    assert sorted(found.ranked_units(0).tolist()) == [0, 1, 2, 3, 5]


@pytest.mark.parametrize("setting", ["level=removed", "scaling=standardized"])
def test_what_is_constant_is_left_out_where_levels_do_not_count(setting: str) -> None:
    one = episode(15, 100)
    one.attributes[:, 0] = 3.0
    one.activations[:, 2] = 0.75
    found = match_units([one], ATTRIBUTES, find_matching_preset("paper", [setting]))
    assert found.flaws == {"speed": "constant in every episode, and levels do not count; left out"}
    assert found.unit_flaws == {2: "constant in every episode, and levels do not count; left out"}
    assert found.ranked_units(0).size == 0
    assert sorted(found.ranked_units(1).tolist()) == [0, 1, 3, 4, 5]


def test_a_level_that_is_removed_does_not_count() -> None:
    one = episode(16, 200)
    shifted = MonitoredEpisode(16, one.activations, one.attributes + 4.0)
    preset = find_matching_preset("paper", ["level=removed"])
    found = match_units([shifted], ATTRIBUTES, preset)
    np.testing.assert_allclose(
        found.discrepancy, match_units([one], ATTRIBUTES, preset).discrepancy, rtol=1e-9
    )
    assert np.isnan(found.level_share).all()


def test_scalings_say_how_attributes_and_units_are_compared() -> None:
    one = episode(17, 200)
    raw = match_units([one], ATTRIBUTES, find_matching_preset("paper", ["scaling=raw"]))
    by_hand = [Attribute(attribute.name, attribute.unit) for attribute in ATTRIBUTES]
    np.testing.assert_array_equal(raw.discrepancy, match_units([one], by_hand, PRESETS["paper"]).discrepancy)
    standard = match_units([one], ATTRIBUTES, find_matching_preset("paper", ["scaling=standardized"]))
    z = (one.activations - one.activations.mean(0, float)) / one.activations.std(0, dtype=float)
    s = (one.attributes - one.attributes.mean(0)) / one.attributes.std(0)
    expected = by_scipy(MonitoredEpisode(17, z, s), by_hand, PRESETS["paper"])
    np.testing.assert_allclose(standard.discrepancy, expected, rtol=1e-6)


def test_angles_can_stay_wrapped() -> None:
    turning = np.linspace(0.0, 20.0, 200)[:, None]
    wrapped = np.angle(np.exp(1j * turning))
    units = episode(18, 200).activations
    yaw = (Attribute("yaw", "rad", wraps=True),)
    found = match_units(
        [MonitoredEpisode(0, units, turning)], yaw, find_matching_preset("paper", ["angles=wrapped"])
    )
    expected = match_units([MonitoredEpisode(0, units, wrapped)], yaw, PRESETS["paper"])
    np.testing.assert_allclose(found.discrepancy, expected.discrepancy, rtol=1e-9)


@pytest.mark.parametrize("preset", PRESETS.values(), ids=list(PRESETS))
def test_the_order_is_that_of_double_precision_where_single_precision_cannot_tell(
    preset: MatchingPreset,
) -> None:
    """Some units differ from others by the last digit of one sample."""
    rng = np.random.default_rng(19)
    one = episode(19, 400, units=40)
    twins = np.hstack([one.activations] * 4)
    for twin in range(4):
        sample = twins[100 + 17 * twin, 40 * twin : 40 * twin + 40]
        sample[:] = np.nextafter(sample, np.float32(2.0))
    level = 5.0 + 0.5 * rng.standard_normal((400, 40)).cumsum(axis=0)  # what loses most digits
    activations = np.hstack([one.activations, twins, level.astype(np.float32)])
    paired = MonitoredEpisode(19, activations, one.attributes)
    series = scaled_attribute_series([paired], ATTRIBUTES, preset)
    single = measure_in_single_precision([paired], series, preset)
    expected = by_scipy(paired, ATTRIBUTES, preset)
    assert (np.abs(single.distance - expected) <= single.bound).all()
    orders = np.argsort(expected, axis=1)
    assert (np.argsort(single.distance, axis=1) != orders).any()  # so single precision is not enough
    found = match_units([paired], ATTRIBUTES, preset)
    for row in range(2):
        np.testing.assert_array_equal(found.ranked_units(row), orders[row])


def test_units_that_never_fire_tie_and_are_measured_once() -> None:
    one = episode(20, 150, units=30)
    one.activations[:, 5:25] = 0.0
    found = match_units([one], ATTRIBUTES, PRESETS["paper"])
    expected = by_scipy(one, ATTRIBUTES, PRESETS["paper"])
    np.testing.assert_allclose(found.discrepancy, expected, rtol=1e-6)
    assert (np.ptp(found.discrepancy[:, 5:25], axis=1) == 0).all()


def test_signals_beyond_single_precision_are_measured_in_double() -> None:
    one = episode(21, 150)
    loud = MonitoredEpisode(21, one.activations, one.attributes * [1e11, 1e-20])
    found = match_units([loud], ATTRIBUTES, PRESETS["paper"])
    np.testing.assert_allclose(found.discrepancy, by_scipy(loud, ATTRIBUTES, PRESETS["paper"]), rtol=1e-6)


def test_long_windows_are_measured_by_transforms() -> None:
    one, preset = episode(22, 900), find_matching_preset("paper", ["length=300", "hop=50"])
    found = match_units([one], ATTRIBUTES, preset)
    np.testing.assert_allclose(found.discrepancy, by_scipy(one, ATTRIBUTES, preset), rtol=1e-9)
