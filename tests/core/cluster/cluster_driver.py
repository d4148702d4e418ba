"""A driver that probes units on a cluster and keeps a journal: run by tests, and killed by them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from pdtui.core.cluster.ray_cluster import RayCluster, Workers
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.rollout_journal import RolloutJournal
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states

UNITS, VALUES, STARTS, STEPS = tuple(range(8)), (-3.0, 3.0), 3, 300
ROLLOUTS = len(UNITS) * len(VALUES) * STARTS + STARTS
"""Roll-outs of `probe_units`; the last are those without stimulation."""


def probe_units(
    policy: Path, journal: Path, workers: Workers, progress: Callable[[int, int], None] | None = None
) -> UnitEffects:
    """Measure what units of an Ant's policy do; roll-outs that the journal holds are not run again."""
    with RolloutPool("ant", policy, workers) as pool, RolloutJournal(journal, "test") as kept:
        starts = collect_start_states(pool.robot, pool.policy, 1000, STARTS, at=20)
        return EffectProbe(pool, kept).measure_units(UNITS, VALUES, starts, steps=STEPS, progress=progress)


if __name__ == "__main__":
    with RayCluster(sys.argv[1]) as cluster:
        probe_units(Path(sys.argv[2]), Path(sys.argv[3]), cluster)
