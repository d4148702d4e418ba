"""Units with known effects, in a world where one turns once and another goes on turning."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from pdtui.dissection.primitive_judging import PrimitiveJudgment, judge_primitives, measure_own_range
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.unit_selection import PrimitiveCandidate
from pdtui.spectra.episode_monitor import monitor_episodes
from tests.compass_world import SPIN, TURN, UNITS, Compass, compass_policy
from tests.small_dissection import SMALL

NOTHING = 7
COLUMN = 1


@cache
def judged() -> PrimitiveJudgment:
    settings = replace(
        SMALL, screen_values=(-3.0, 3.0), refine_steps=12, held_steps=300, judge_starts=8, walk_steps=10
    )
    candidates = [PrimitiveCandidate(unit, COLUMN, 3.0, 1.0) for unit in (TURN, SPIN)]
    with RolloutPool(Compass(), compass_policy(), 1) as pool:
        episodes = monitor_episodes(pool.robot, pool.policy, [0, 1], 60)
        starts = collect_start_states(pool.robot, pool.policy, 100, 8, at=10)
        return judge_primitives(
            EffectProbe(pool),
            pool.robot.attributes,
            [*candidates, PrimitiveCandidate(NOTHING, COLUMN, 3.0, 1.0)],
            tuple(range(UNITS)),
            measure_own_range(episodes),
            starts,
            settings,
            0,
        )


def test_a_spin_is_confirmed_and_a_turn_is_not() -> None:
    turn, spin, nothing = judged().confirmations
    assert turn.verdict.confirmed
    assert spin.verdict.confirmed
    assert turn.held is not None
    assert spin.held is not None
    # Held, the turn has come to its end. What it spins by its small weight is not chance, but not the effect.
    assert turn.held.confirmed
    assert turn.held.measured.effect < 0.1 * turn.verdict.measured.effect
    assert spin.held.measured.effect > 1.0
    assert (turn.confirmed, spin.confirmed, nothing.confirmed) == (False, True, False)
    assert nothing.held is None


def test_the_strongest_comes_first_and_a_pair_can_be_asked_for() -> None:
    judgment = judged()
    assert judgment.of_attribute(COLUMN)[0].unit == SPIN
    found = judgment.of_pair(TURN, COLUMN)
    assert found is not None
    assert not found.in_range
    assert judgment.of_pair(TURN, 0) is None
    assert judgment.control_effects.values == (-3.0, 3.0)
