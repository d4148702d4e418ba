from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import Attribute
from pdtui.search.imprint_candidates import ImprintSettings, assign_range_bins, build_imprint_candidates
from pdtui.spectra.episode_monitor import MonitoredEpisode

HEIGHT, YAW, TORQUE = Attribute("height", "m"), Attribute("yaw", "rad", wraps=True), Attribute("knee", "N m")


def test_values_are_cut_into_parts_of_equal_size_and_angles_into_equal_arcs() -> None:
    np.testing.assert_array_equal(assign_range_bins(np.array([5.0, 1.0, 3.0, 8.0]), HEIGHT, 2), [1, 0, 0, 1])
    angles = np.array([-3.0, -0.1, 0.1, 3.0, 3.0 + 2 * np.pi])
    np.testing.assert_array_equal(assign_range_bins(angles, YAW, 2), [0, 0, 1, 1, 1])


def test_an_imprint_shows_what_the_telling_units_put_out_in_that_part() -> None:
    rng = np.random.default_rng(3)
    height = np.repeat([0.0, 1.0], 50)
    activations = rng.normal(0, 1.0, (100, 4)).astype(np.float32)
    activations[:, 2] = np.where(height > 0.5, 0.8, -0.4)
    episode = MonitoredEpisode(0, activations, np.column_stack([height, np.ones(100)]))
    settings = ImprintSettings(bins=2, units=(1,), factors=(1.0, 3.0))
    plans = build_imprint_candidates([episode], [HEIGHT, TORQUE], (4,), settings, 2.0)
    assert {plan.units for plan in plans} == {(2,)}
    # By hand: the mean is 0.2; three times as far from it are −1.6 and 2.0.
    assert sorted(plan.values[0] for plan in plans) == pytest.approx([-1.6, -0.4, 0.8, 2.0])


def test_an_attribute_that_is_not_finite_is_left_out() -> None:
    episode = MonitoredEpisode(0, np.ones((4, 2), np.float32), np.full((4, 1), np.nan))
    assert build_imprint_candidates([episode], [HEIGHT], (2,), ImprintSettings(units=(1,)), 2.0) == ()
