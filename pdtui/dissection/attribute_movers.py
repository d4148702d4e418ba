"""Finds what moves each attribute up and down: a confirmed unit, or two whose side effects cancel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import Stimulation
from pdtui.dissection.dissection_config import DissectionSettings
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.measured_effects import PlanEffects, UnitEffects
from pdtui.probing.primitive_confirmation import judge_effects
from pdtui.probing.start_states import StartState
from pdtui.probing.unit_selection import exceeds_random_units
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.stimulation.stimulation_map import MeasuredEffect

_KEPT = 0.7
"""Share of the main effect that a second unit has to keep, and share of the side effects that it may keep."""
_MAX_FALLS = 0.2
"""Largest share of the judging starts from which the robot may fall."""
_SAME = 0.99
"""Correlation at which two attributes show the same."""


@dataclass(frozen=True)
class AttributeMover:
    """A stimulation that moves one attribute up or down.

    Attributes:
        sign: 1 for up, −1 for down.
        stimulation: One unit, or two.
        measured: Change of the attribute, from held-out starts.
        side: Largest change of any other attribute, in standard deviations of that attribute.
        main: Change of this attribute, in its standard deviations.
        alone: `side` of the best single unit if a second one was added to cancel it, else None.
    """

    column: int
    sign: int
    stimulation: Stimulation
    measured: MeasuredEffect
    side: float
    main: float
    alone: float | None = None


def movable_attribute_columns(
    attributes: Sequence[Attribute], episodes: Sequence[MonitoredEpisode]
) -> list[int]:
    """Return the columns of the attributes that behaviors may be proposed for.

    Left out are torques, which the policy commands; the reward; attributes that do not vary; attributes that
    mostly progress, such as the position along the way; and attributes that show the same as an earlier
    column, such as the speed of a robot that only walks forward.
    """
    values = np.concatenate([episode.attributes for episode in episodes])
    kept: list[int] = []
    for column, attribute in enumerate(attributes):
        series = values[:, column]
        if attribute.unit == "N m" or attribute.name == "reward":
            continue
        if not np.isfinite(series).all() or np.ptp(series) == 0:
            continue
        if not attribute.wraps and all(_runs_on(episode.attributes[:, column]) for episode in episodes):
            continue
        if any(abs(np.corrcoef(series, values[:, other])[0, 1]) > _SAME for other in kept):
            continue
        kept.append(column)
    return kept


def _runs_on(series: Floats) -> bool:
    """Return whether most change is progress, in the same direction and about as fast in both halves."""
    half = len(series) // 2
    if half < 2:
        return False
    halves = np.stack([series[:half], series[half : 2 * half]])
    progress, changed = halves[:, -1] - halves[:, 0], np.abs(np.diff(halves)).sum(axis=1)
    first, second = progress
    steady = first * second > 0 and 0.5 < second / first < 2.0
    return bool(steady and (np.abs(progress) > 0.5 * changed).all())


def find_attribute_movers(
    prober: EffectProbe,
    columns: Sequence[int],
    spread: Floats,
    screen: UnitEffects,
    refined: UnitEffects,
    choosing: Sequence[StartState],
    judging: Sequence[StartState],
    settings: DissectionSettings,
    progress: StepProgress | None = None,
) -> tuple[AttributeMover, ...]:
    """Return a stimulation for up and one for down, for each attribute that a confirmed unit moves.

    Effects are means over the last two thirds of roll-outs that are much longer than those of the sweeps. A
    unit that only shifts the phase of the gait moves an attribute for half a stride, and then not at all.
    What is returned is confirmed together, by flips of signs at the level of the dissection.

    Args:
        columns: Columns of the attributes. Their side effects count, too.
        spread: Standard deviation of every attribute, shape (J,).
        choosing, judging: Starts that neither sweep used: those that choose units, and those that judge them.
    """
    found = list[AttributeMover]()
    samples, steps = list[Floats](), settings.mover_steps
    asked = [(column, sign) for column in columns for sign in (1, -1)]

    def probe(plans: Sequence[Stimulation], some: Sequence[StartState]) -> PlanEffects:
        return prober.measure_plans(plans, some, steps=steps, measure_from=steps // 3)

    for done, (column, sign) in enumerate(asked, start=1):
        singles = _singles(column, sign, screen, refined, settings.mover_singles)
        lasting = _lasting(probe(singles, choosing), column, sign) if singles else None
        if lasting is not None:
            single = singles[lasting]
            pairs = _canceling(single, column, sign, columns, spread, refined)[: settings.mover_pairs]
            plans = [single, *pairs]
            best = _choose(probe(plans, choosing), column, sign, columns, spread) if pairs else 0
            chosen = [single] if best == 0 else [plans[best], single]
            result = probe(chosen, judging)
            samples.append(result.counted_effects()[0, :, column])
            found.append(_describe(result, samples[-1], chosen, column, sign, columns, spread))
        if progress is not None:
            progress(done, len(asked))
    verdicts = judge_effects(
        np.array(samples),
        [one.sign for one in found],
        None,
        [max(one.stimulation.values, key=abs) for one in found],
        [one.measured.falls or 0 for one in found],
        settings.level,
        seed=None,
    )
    upright = [(one.measured.falls or 0) <= _MAX_FALLS * len(judging) for one in found]
    kept = zip(found, verdicts, upright, strict=True)
    return tuple(one for one, verdict, up in kept if verdict.confirmed and up)


def _singles(
    column: int, sign: int, screen: UnitEffects, refined: UnitEffects, count: int
) -> list[Stimulation]:
    """Return the units, each at its best output, that move the attribute that way most reliably.

    Outputs are within the units' safe ranges, and effects are larger than those of random units.
    """
    robust = refined.robust_effects(column, float(sign)).copy()
    for row, unit in enumerate(refined.units):
        alive = refined.safe_magnitude(unit)
        for dose, value in enumerate(refined.values):
            sure = robust[row, dose] > 0 and abs(value) <= alive
            effect = float(np.nanmean(refined.effects[row, dose, :, column])) if sure else 0.0
            if not sure or not exceeds_random_units(effect, value, column, screen):
                robust[row, dose] = 0.0
    furthest = robust.max(axis=1)
    rows = [int(row) for row in np.argsort(-furthest, kind="stable")[:count] if furthest[row] > 0]
    return [Stimulation((refined.units[row],), (refined.values[robust[row].argmax()],)) for row in rows]


def _lasting(result: PlanEffects, column: int, sign: int) -> int | None:
    """Return the plan that moved the attribute most reliably, from every start and without a fall, if any."""
    weakest = np.where(np.isfinite(result.effects[..., column]), sign * result.effects[..., column], -np.inf)
    sure = np.where(result.falls.any(axis=1), -np.inf, weakest.min(axis=1))
    best = int(np.argmax(sure))
    return best if sure[best] > 0 else None


def _canceling(
    single: Stimulation, column: int, sign: int, columns: Sequence[int], spread: Floats, refined: UnitEffects
) -> list[Stimulation]:
    """Return pairs whose second unit, if effects add up, keeps the main effect and cancels side effects."""
    mean = np.nan_to_num(refined.effects).mean(axis=2) / np.where(spread > 0, spread, 1.0)
    mean[refined.falls.any(axis=2)] = np.nan
    others = [other for other in columns if other != column]
    if not others:
        return []
    row, dose = refined.units.index(single.units[0]), refined.values.index(single.values[0])
    both = mean + mean[row, dose]
    main, side = sign * both[..., column], np.abs(both[..., others]).max(axis=-1)
    alone = np.abs(mean[row, dose, others]).max()
    allowed = (main >= _KEPT * sign * mean[row, dose, column]) & (side <= _KEPT * alone)
    allowed[row] = False
    ranked = np.argsort(np.where(allowed, side, np.inf), axis=None, kind="stable")[: int(allowed.sum())]
    plans = []
    for index in ranked:
        other, value = (int(number) for number in np.unravel_index(int(index), side.shape))
        values = {single.units[0]: single.values[0], refined.units[other]: refined.values[value]}
        plans.append(Stimulation.of(dict(sorted(values.items()))))
    return plans


def _parts(
    result: PlanEffects, row: int, column: int, sign: int, columns: Sequence[int], spread: Floats
) -> tuple[float, float]:
    """Return the main and the largest side effect of a plan, in standard deviations."""
    mean = np.nan_to_num(result.effects[row]).mean(axis=0) / np.where(spread > 0, spread, 1.0)
    others = [abs(float(mean[other])) for other in columns if other != column]
    return sign * float(mean[column]), max(others, default=0.0)


def _choose(result: PlanEffects, column: int, sign: int, columns: Sequence[int], spread: Floats) -> int:
    """Return the plan of least side effect among those that keep most of the first plan's main effect."""
    main, side = _parts(result, 0, column, sign, columns, spread)
    best, least = 0, _KEPT * side
    for row in range(1, len(result.effects)):
        kept, beside = _parts(result, row, column, sign, columns, spread)
        if not result.falls[row].any() and kept >= _KEPT * main and beside < least:
            best, least = row, beside
    return best


def _describe(
    result: PlanEffects,
    samples: Floats,
    chosen: Sequence[Stimulation],
    column: int,
    sign: int,
    columns: Sequence[int],
    spread: Floats,
) -> AttributeMover:
    falls = result.falls[0]
    low, high = bootstrap_interval(samples, 0)
    main, side = _parts(result, 0, column, sign, columns, spread)
    alone = None if len(chosen) == 1 else _parts(result, 1, column, sign, columns, spread)[1]
    measured = MeasuredEffect(float(samples.mean()), low, high, int(falls.sum()), len(falls))
    return AttributeMover(column, sign, chosen[0], measured, side, main, alone)
