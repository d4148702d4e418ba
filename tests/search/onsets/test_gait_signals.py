from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import Attribute, Floats
from pdtui.search.onsets.gait_signals import find_gait_marks

DT = 0.02
NAMES = ("foot height", "wobble", "noise", "way", "yaw", "slow")
ATTRIBUTES = [Attribute(name, "m", wraps=name == "yaw") for name in NAMES]


def _walk(seed: int) -> Floats:
    """A stride of 0.5 s, one that varies by a tenth, noise, and what has no cycle that is short enough."""
    rng, time = np.random.default_rng(seed), np.arange(600) * DT
    stride = 2.0 * np.pi * time / 0.5
    drift = 0.4 * np.cumsum(rng.normal(size=time.size)) / 5.0
    return np.stack(
        [
            0.1 + 0.1 * np.sin(stride + seed) + 0.004 * np.sin(9.0 * stride),
            np.sin(stride + drift),
            rng.normal(size=time.size),
            2.0 * time,
            np.sin(stride),
            np.sin(2.0 * np.pi * time / 3.0),
        ],
        axis=1,
    )


def test_the_most_regular_oscillation_comes_first_with_its_cycle() -> None:
    found = find_gait_marks([_walk(1), _walk(2)], ATTRIBUTES, DT, 3)
    assert found[0][0].signal == "foot height"
    assert found[0][1] == pytest.approx(0.5, rel=0.02)
    # Ripples on the signal do not count as strides.
    assert found[0][0].minimum_spacing > 0.2
    assert {mark.signal for mark, _ in found} <= {"foot height", "wobble"}


def test_at_most_so_many_are_returned_and_none_where_nothing_walks() -> None:
    assert len(find_gait_marks([_walk(1)], ATTRIBUTES, DT, 1)) == 1
    rng = np.random.default_rng(0)
    assert find_gait_marks([rng.normal(size=(600, 6))], ATTRIBUTES, DT, 3) == []
    assert find_gait_marks([np.zeros((600, 6))], ATTRIBUTES, DT, 3) == []
