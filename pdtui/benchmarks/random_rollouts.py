"""The stimulated roll-outs that benchmarks run: the same in every round and every process."""

from __future__ import annotations

import numpy as np

from pdtui.core.units import Stimulation
from pdtui.probing.stimulated_rollout import RolloutJob


def draw_rollout_jobs(count: int, units: int, starts: int) -> list[RolloutJob]:
    """Return roll-outs of one unit each, drawn with its output at random, from the starts in turn."""
    rng = np.random.default_rng(0)
    return [
        (Stimulation((int(rng.integers(units)),), (float(rng.normal(0, 3)),)), number % starts)
        for number in range(count)
    ]
