"""Sets of units that are probed once and shared by all searches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.units import Stimulation
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.start_states import StartState
from pdtui.robots.robot_goals import BehaviorGoal
from pdtui.search.behavior_goals import goal_scores
from pdtui.search.behavior_search_settings import BehaviorSearchSettings
from pdtui.search.stimulation_sampler import StimulationSampler
from pdtui.spectra.monitor import StepProgress


class SharedCandidates:
    """Sets of units, probed once for all goals: where searches begin when no single unit leads the way.

    Args:
        prober: measures.
        plans: what to probe.
        starts: a few of the search starts.
        steps: control steps of each roll-out.
        progress: called with (roll-outs done, roll-outs).
    """

    def __init__(
        self,
        prober: EffectProbe,
        plans: Sequence[Stimulation],
        starts: Sequence[StartState],
        steps: int,
        progress: StepProgress | None = None,
    ) -> None:
        self.plans = tuple(plans)
        self.effects = prober.measure_plans(
            self.plans, starts, steps=steps, measure_from=steps // 3, progress=progress
        )

    def best(self, goal: BehaviorGoal, column: int, count: int, most: int) -> list[Stimulation]:
        """Those of at most so many units that went the goal's way furthest."""
        if not self.plans:
            return []
        scored = goal_scores(goal, column, self.effects, [len(plan.units) for plan in self.plans])
        order = [int(index) for index in np.argsort(-scored, kind="stable")]
        return [self.plans[index] for index in order if len(self.plans[index].units) <= most][:count]

    def opposites(self, column: int, count: int) -> list[tuple[Stimulation, Stimulation]]:
        """Pairs of plans on the same units that raise and lower an attribute, the strongest pairs first.

        A pair is as strong as its weaker side; plans that fell are left out.
        """
        effect = np.nan_to_num(self.effects.effects[..., column]).mean(axis=1)
        effect[self.effects.falls.any(axis=1)] = 0.0
        same: dict[tuple[int, ...], list[int]] = {}
        for index, plan in enumerate(self.plans):
            same.setdefault(plan.units, []).append(index)
        pairs = []
        for indices in same.values():
            high, low = max(indices, key=lambda i: effect[i]), min(indices, key=lambda i: effect[i])
            strength = min(float(effect[high]), -float(effect[low]))
            if strength > 0:
                pairs.append((strength, self.plans[high], self.plans[low]))
        pairs.sort(key=lambda pair: (-pair[0], pair[1].units))
        return [(high, low) for _, high, low in pairs[:count]]


def draw_random_candidates(units: int, settings: BehaviorSearchSettings, seed: int) -> list[Stimulation]:
    """Pairs and triples of units, drawn at random."""
    source = StimulationSampler(np.ones(units), settings.bounds, seed)
    most = min(3, units)
    return [
        source.draw(int(source.rng.integers(min(2, most), most + 1))) for _ in range(settings.random_sets)
    ]
