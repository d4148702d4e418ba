"""Candidate stimulations that are probed once and shared by all searches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import Stimulation
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.start_states import StartState
from pdtui.robots.robot_goals import BehaviorGoal
from pdtui.search.goal_scores import score_plans_by_goal
from pdtui.search.stimulation_sampler import StimulationSampler, UnitOutputBounds


class SharedCandidates:
    """Stimulations of several units, probed once: searches begin with them where no single unit helps.

    Args:
        prober: runs the roll-outs.
        plans: stimulations to probe.
        starts: start states.
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

    def best(self, goal: BehaviorGoal, column: int, count: int, max_units: int) -> list[Stimulation]:
        """Return the `count` plans of at most `max_units` units with the highest scores for a goal."""
        if not self.plans:
            return []
        scored = score_plans_by_goal(goal, column, self.effects, [len(plan.units) for plan in self.plans])
        order = [int(index) for index in np.argsort(-scored, kind="stable")]
        return [self.plans[index] for index in order if len(self.plans[index].units) <= max_units][:count]

    def opposites(self, column: int, count: int) -> list[tuple[Stimulation, Stimulation]]:
        """Return pairs of plans on the same units that raise and lower an attribute, the strongest first.

        A pair is as strong as its weaker plan; plans that made the robot fall do not count.
        """
        effect = np.nan_to_num(self.effects.effects[..., column]).mean(axis=1)
        effect[self.effects.falls.any(axis=1)] = 0.0
        by_units: dict[tuple[int, ...], list[int]] = {}
        for index, plan in enumerate(self.plans):
            by_units.setdefault(plan.units, []).append(index)
        pairs = []
        for indices in by_units.values():
            high, low = max(indices, key=lambda i: effect[i]), min(indices, key=lambda i: effect[i])
            strength = min(float(effect[high]), -float(effect[low]))
            if strength > 0:
                pairs.append((strength, self.plans[high], self.plans[low]))
        pairs.sort(key=lambda pair: (-pair[0], pair[1].units))
        return [(high, low) for _, high, low in pairs[:count]]


def sample_random_candidates(
    units: int, count: int, bounds: UnitOutputBounds, seed: int
) -> list[Stimulation]:
    """Draw `count` pairs and triples of a policy's units, with random outputs."""
    sampler = StimulationSampler(np.ones(units), bounds, seed)
    most = min(3, units)
    return [sampler.draw(int(sampler.rng.integers(min(2, most), most + 1))) for _ in range(count)]
