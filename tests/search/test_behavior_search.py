"""A search finds the one unit that spins, and says so where any unit would have done."""

from __future__ import annotations

from functools import partial

from pdtui.core.attributes import BehaviorAim
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.robots.robot_goals import BehaviorGoal
from pdtui.search.behavior_search import (
    BehaviorSearch,
    BehaviorSearchResult,
    BehaviorSearchSettings,
    SearchStartStates,
)
from pdtui.search.shared_candidates import SharedCandidates
from tests.compass_world import SPIN, UNITS, Compass, compass_policy

COLUMN = 1
GOAL = BehaviorGoal("spin", "s", "spins", BehaviorAim("turning rate", "increase"), 1.0)
SETTINGS = BehaviorSearchSettings(
    single_units=4, elite=4, children=4, promoted=3, max_units=(1,), generations=1, finalists=2,
    quick_starts=1, quick_steps=12, full_starts=2, full_steps=24, final_steps=24,
)  # fmt: skip


def search(policy: Policy) -> BehaviorSearchResult:
    with RolloutPool(Compass(), policy, 1) as pool:
        collect = partial(collect_start_states, pool.robot, pool.policy, at=10)
        few, chosen, held = (tuple(collect(seed, count)) for seed, count in ((0, 2), (50, 4), (90, 8)))
        probe = EffectProbe(pool)
        sweep = probe.measure_units(range(UNITS), (-3.0, 3.0), few, steps=12)
        starts, shared = SearchStartStates(few, chosen, held), SharedCandidates(probe, [], few, 12)
        return BehaviorSearch(probe, GOAL, COLUMN, starts, [sweep], shared, 7, SETTINGS).run(lambda: False)


def test_a_unit_that_alone_spins_beats_random_units() -> None:
    found = search(compass_policy())
    assert found.stimulation.units == (SPIN,)
    assert len(found.rival.units) == 1
    assert found.rival_gain < 0.1 * found.gain.effect
    assert found.rival_p == 2.0**-7  # eight starts, all of one sign
    assert found.reached


def test_a_unit_is_not_found_where_any_would_have_done() -> None:
    found = search(compass_policy(every=3.0))
    assert found.reliable
    assert found.rival_gain > found.gain.effect
    assert not found.beats_rival
    assert not found.reached
