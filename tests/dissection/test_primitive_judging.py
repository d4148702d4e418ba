"""Units with known effects, in a world where one turns once and another goes on turning."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.attributes import Attribute, Floats
from pdtui.dissection.primitive_judging import PrimitiveJudgement, judge_primitives, measure_own_range
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.unit_selection import PrimitiveCandidate
from pdtui.spectra.episode_monitor import monitor_episodes
from tests.small_dissection import SMALL
from tests.small_worlds import _Small

UNITS, TURN, SPIN, NOTHING = 90, 5, 6, 7
COLUMN = 1


class Compass(_Small):
    """Something that turns to where the first action points, and goes on turning by the second."""

    name = "compass"
    title = "Compass"
    attributes = (Attribute("heading", "rad"), Attribute("turning rate", "rad/s"))
    observation_space = gymnasium.spaces.Box(-9.0, 9.0, (1,), np.float64)
    action_space = gymnasium.spaces.Box(-9.0, 9.0, (2,))

    def _begin(self) -> Floats:
        return np.concatenate([self.np_random.uniform(-0.5, 0.5, 1), np.zeros(2)])

    def observe(self) -> Floats:
        return np.sin(self.state[1:2])

    def step(self, action: NDArray[np.float32]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        # The spin moves the origin to which a turn is relative.
        turn, spin = (float(one) for one in action)
        heading, origin, _ = self.state
        rate = 2.0 * (turn - (heading - origin)) + spin + 0.02 * self.np_random.normal()
        self.state = np.array([heading + self.control_dt * rate, origin + self.control_dt * spin, rate])
        return self.observe(), 0.0, False, False, {"cost": 0.0}

    def read_attributes(self) -> Floats:
        return self.state[[0, 2]]

    def _place(self) -> tuple[float, float]:
        return float(self.state[0]), 0.0


def compass_policy() -> Policy:
    """One unit sets where to turn to, another how fast to spin; the others do next to nothing."""
    torch.manual_seed(3)
    network = nn.Sequential(nn.Linear(1, UNITS), nn.Tanh(), nn.Linear(UNITS, 2))
    head = network[2]
    assert isinstance(head, nn.Linear)
    with torch.no_grad():
        head.weight.mul_(0.002)
        head.bias.zero_()
        head.weight[0, TURN] = head.weight[1, SPIN] = 0.5
    return Policy(network, 1, name="compass")


@cache
def judged() -> PrimitiveJudgement:
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
    judgement = judged()
    assert judgement.of_attribute(COLUMN)[0].unit == SPIN
    found = judgement.of_pair(TURN, COLUMN)
    assert found is not None
    assert not found.in_range
    assert judgement.of_pair(TURN, 0) is None
    assert judgement.control_effects.values == (-3.0, 3.0)
