"""Judge the units that were chosen as motor primitives, on starts that chose nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.dissection.dissection_config import DissectionSettings
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import UnitEffects
from pdtui.probing.null_distributions import smallest_p_value
from pdtui.probing.primitive_confirmation import (
    EffectVerdict,
    PrimitiveConfirmation,
    judge_candidates,
    judge_effects,
)
from pdtui.probing.start_states import StartState
from pdtui.probing.unit_selection import PrimitiveCandidate
from pdtui.spectra.episode_monitor import MonitoredEpisode


@dataclass(frozen=True)
class PrimitiveJudgment:
    """What the judging starts say about the candidates of all attributes.

    Attributes:
        confirmations: One for each pair of a unit and an attribute that was judged.
        controls: Units drawn at random.
        control_effects: Effects of the controls at the outputs at which all units were screened.
        own_range: Lowest and highest output of every unit in the monitored episodes, shape (U, 2).
        starts: Number of judging starts.
        level: Share of the confirmed pairs that may be false.
    """

    confirmations: tuple[PrimitiveConfirmation, ...]
    controls: tuple[int, ...]
    control_effects: UnitEffects
    own_range: Floats
    starts: int
    level: float

    @property
    def smallest_p(self) -> float:
        """The smallest p-value that a pair can have, whatever its effect."""
        # A candidate that is itself a control is compared with one control less.
        return smallest_p_value(self.starts, len(self.controls) - 1)

    @property
    def fewest_confirmed(self) -> int | None:
        """The least number of pairs that are confirmed if any is; None if none can be.

        So many pairs with the smallest p-value pass the correction if the other pairs show nothing.
        """
        if self.smallest_p > self.level:
            return None
        return max(1, int(np.ceil(len(self.confirmations) * self.smallest_p / self.level - 1e-9)))

    def of_attribute(self, column: int) -> list[PrimitiveConfirmation]:
        """Return the pairs of an attribute: confirmed ones first, then by the size of their effect."""
        pairs = [one for one in self.confirmations if one.column == column]
        return sorted(pairs, key=lambda one: (not one.confirmed, -abs(one.verdict.measured.effect)))

    def of_pair(self, unit: int, column: int) -> PrimitiveConfirmation | None:
        """Return what is known about a unit and an attribute; None if they were not judged."""
        return next((one for one in self.of_attribute(column) if one.unit == unit), None)


def measure_own_range(episodes: Sequence[MonitoredEpisode]) -> Floats:
    """Return the lowest and the highest output of every unit in the monitored episodes, shape (U, 2)."""
    lows = np.min([episode.activations.min(axis=0) for episode in episodes], axis=0)
    highs = np.max([episode.activations.max(axis=0) for episode in episodes], axis=0)
    return np.stack([lows, highs], axis=1).astype(np.float64)


def is_rate(attribute: Attribute) -> bool:
    """Return whether an attribute is a change per time, which can pass although it is caused for ever."""
    return attribute.unit.endswith("/s")


def judge_primitives(
    prober: EffectProbe,
    attributes: Sequence[Attribute],
    candidates: Sequence[PrimitiveCandidate],
    controls: tuple[int, ...],
    own_range: Floats,
    starts: Sequence[StartState],
    settings: DissectionSettings,
    seed: int,
    progress: StepProgress | None = None,
) -> PrimitiveJudgment:
    """Probe candidates and controls from the judging starts, and hold what moves a rate for long.

    Args:
        own_range: Lowest and highest output of every unit by itself, shape (U, 2).
        starts: Starts that chose neither the units nor their outputs.
    """
    values, units = settings.screen_values, sorted({*controls, *(one.unit for one in candidates)})
    outputs = [(unit, value) for unit in units for value in values]
    outputs += [(one.unit, -one.value) for one in candidates]
    outputs += [(unit, float(end)) for unit in units for end in own_range[unit]]
    probed = prober.measure_outputs(outputs, starts, steps=settings.refine_steps, progress=progress)
    judged = judge_candidates(candidates, probed, own_range, controls, settings.level, seed)
    held = _hold_rates(prober, attributes, judged, candidates, starts, settings, seed)
    return PrimitiveJudgment(
        tuple(replace(one, held=held.get(number)) for number, one in enumerate(judged)),
        controls,
        probed.select(controls, values),
        own_range,
        len(starts),
        settings.level,
    )


def _hold_rates(
    prober: EffectProbe,
    attributes: Sequence[Attribute],
    judged: Sequence[PrimitiveConfirmation],
    candidates: Sequence[PrimitiveCandidate],
    starts: Sequence[StartState],
    settings: DissectionSettings,
    seed: int,
) -> dict[int, EffectVerdict]:
    """Return what is left of confirmed effects on rates in the second half of a long roll-out.

    A unit that turns the robot once moves its yaw rate for a while, and then not at all.
    """
    numbers = [
        number for number, one in enumerate(judged) if one.confirmed and is_rate(attributes[one.column])
    ]
    if not numbers:
        return {}
    pairs = [(candidates[number].unit, candidates[number].value) for number in numbers]
    probed = prober.measure_outputs(pairs, starts, steps=settings.held_steps)
    columns = [candidates[number].column for number in numbers]
    verdicts = judge_effects(
        np.array([probed.effects_of(*pair)[:, column] for pair, column in zip(pairs, columns, strict=True)]),
        [candidates[number].sign for number in numbers],
        None,
        [value for _, value in pairs],
        [probed.falls_of(*pair) for pair in pairs],
        settings.level,
        seed,
    )
    return dict(zip(numbers, verdicts, strict=True))
