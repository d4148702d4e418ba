from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pdtui.core.attributes import Floats
from pdtui.dissection.dissection_result import Dissection
from pdtui.pictures.dissection_chart_data import (
    compute_spectrogram_chart,
    matched_spectrograms,
    side_effect_matrix,
)
from pdtui.pictures.plot_colors import BLUE, GRAY, VERMILLION, diverging_colors
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import PRESETS, find_matching_preset


def test_the_pictured_spectrograms_are_those_that_were_compared(
    dissection: Dissection, policy_file: Path
) -> None:
    robot, steps = make_robot("ant"), len(dissection.sample_episode.attributes)
    episodes = monitor_episodes(robot, load_policy(policy_file), [dissection.sample_episode.seed], steps)
    alone = match_units(episodes, robot.attributes, dissection.preset)
    for name in ("vx", "yaw", "height"):
        column = dissection.column(name)
        pair = matched_spectrograms(dissection, column)
        assert pair is not None
        assert pair.unit == dissection.matching.ranked_units(column)[0]
        one, other = (10 ** (shown.decibels / 10) for shown in (pair.of_attribute, pair.of_unit))
        distance = np.sqrt(((one - other) ** 2).sum())
        assert distance == pytest.approx(alone.discrepancy[column, pair.unit], rel=1e-6)


@pytest.mark.parametrize("name", list(PRESETS))
def test_a_sine_is_loudest_at_its_frequency_and_its_windows_lie_inside(name: str) -> None:
    preset, dt = PRESETS[name], 0.05
    frequency = preset.frequencies(dt)[6]
    series = np.sin(2 * np.pi * frequency * np.arange(200) * dt)
    shown = compute_spectrogram_chart(series, preset, dt)
    assert shown.frequencies[shown.decibels.mean(axis=0).argmax()] == frequency
    # A sine of amplitude 1 puts half of it into its bin: −6.02 dB.
    np.testing.assert_allclose(shown.decibels[:, 6], 20 * np.log10(0.5), atol=1e-6)
    assert shown.times[0] == preset.length / 2 * dt
    assert shown.times[-1] + preset.length / 2 * dt <= 200 * dt + 1e-9


def test_what_a_preset_does_not_compare_is_not_shown() -> None:
    preset = find_matching_preset("paper", ["level=removed"])
    shown = compute_spectrogram_chart(np.ones(100) + np.cos(np.arange(100.0)), preset, 0.05)
    assert np.isneginf(shown.decibels[:, : preset.level_bins]).all()
    assert np.isfinite(shown.decibels[:, preset.level_bins :]).all()


def test_side_effects_leave_out_units_that_are_only_controls(dissection: Dissection) -> None:
    effects = side_effect_matrix(dissection)
    assert len(effects.units) == len(set(effects.units)) <= len(dissection.refined.units)
    for column in range(len(dissection.attributes)):
        (first,) = dissection.matches(dissection.attributes[column].name, 1)
        assert first in effects.units
    for matrix in effects.by_value.values():
        assert matrix.shape == (len(effects.units), len(dissection.attributes))
    assert 0 < effects.limit <= 3.0


def test_diverging_colors() -> None:
    values: Floats = np.array([-9.0, -2.0, 0.0, 1.0, 2.0, np.nan])
    colors = diverging_colors(values, 2.0)
    assert colors.dtype == np.uint8
    np.testing.assert_array_equal(colors[[0, 1, 2, 4, 5]], [VERMILLION, VERMILLION, (255,) * 3, BLUE, GRAY])
    assert (colors[3] > np.array(BLUE)).all()
