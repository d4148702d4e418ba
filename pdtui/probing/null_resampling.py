"""Draws of effects among which nothing is to be found, chosen and judged as those of a dissection are.

Two nulls. *Without effect*: what is taken for a stimulated roll-out is the undisturbed one from another
start, drawn at random, so that no unit does anything. *Exchanged*: the roll-outs are real, but after the
choice the units change their names, so that what was chosen is a random unit.

Shuffled weights would be no null: a unit of a shuffled network moves the robot, too, and to confirm that is
right.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.probing.measured_effects import PlanEffects, SingleUnitEffects
from pdtui.probing.primitive_confirmation import judge_candidates
from pdtui.probing.unit_selection import choose_primitive_candidates
from pdtui.spectra.matching import UnitDiscrepancies


@dataclass(frozen=True)
class NullResampler:
    """What draws of a null are made from. All that a draw confirms is false.

    Attributes:
        matching: discrepancies of all units and attributes.
        controls: the units that were probed, drawn at random.
        own_range: lowest and highest output of every unit by itself, shape (U, 2).
        choosing: number of the first starts, which choose units and outputs; the others judge.
        values: outputs that are judged.
        keep: units judged for each attribute, besides its first match.
        level: share of false discoveries that is accepted.
        probed: effects of the controls, at these outputs and at the ends of their own ranges.
        bank: undisturbed roll-outs, from these starts and more.
    """

    matching: UnitDiscrepancies
    controls: tuple[int, ...]
    own_range: Floats
    choosing: int
    values: tuple[float, ...]
    keep: int
    level: float
    probed: SingleUnitEffects
    bank: PlanEffects

    def draw_without_effect(self, rng: np.random.Generator) -> tuple[int, int]:
        """Take undisturbed roll-outs for stimulated ones; return the pairs judged and those confirmed."""
        plans, bank = self.probed.plans, self.bank
        drawn: NDArray[np.intp] = rng.integers(len(bank.unperturbed), size=plans.falls.shape)
        means = bank.unperturbed[drawn]
        undisturbed = replace(
            plans, effects=means - plans.unperturbed, means=means, falls=bank.unperturbed_falls[drawn]
        )
        return self._count(replace(self.probed, plans=undisturbed), self.controls)

    def draw_exchanged(self, rng: np.random.Generator) -> tuple[int, int]:
        """Exchange the units after the choice; return the pairs judged and those confirmed."""
        return self._count(self.probed, rng.permutation(self.controls).tolist())

    def _count(self, probed: SingleUnitEffects, renamed: tuple[int, ...] | list[int]) -> tuple[int, int]:
        """Choose among the controls, and judge the units that they are renamed to."""
        chooser = probed.from_starts(slice(self.choosing)).select(self.controls, self.values)
        # Only controls were probed, so no other unit can match.
        discrepancy = np.full_like(self.matching.discrepancy, np.nan)
        discrepancy[:, self.controls] = self.matching.discrepancy[:, self.controls]
        matching = replace(self.matching, discrepancy=discrepancy)
        candidates = choose_primitive_candidates(
            chooser, chooser, matching, range(len(discrepancy)), self.values, self.keep
        )
        names = dict(zip(self.controls, renamed, strict=True))
        verdicts = judge_candidates(
            [replace(one, unit=names[one.unit]) for one in candidates],
            probed.from_starts(slice(self.choosing, None)),
            self.own_range,
            self.controls,
            self.level,
            seed=None,
        )
        return len(verdicts), sum(one.verdict.confirmed for one in verdicts)
