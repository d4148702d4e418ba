"""Up and down for each attribute: the best confirmed unit, or two units whose side effects cancel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.dissection.confirm import exceeds_random
from pdtui.dissection.monitor import Start
from pdtui.dissection.probe import Effects, Prober, Sweep, bootstrap_interval
from pdtui.policies.units import Stimulation
from pdtui.robots.types import Attribute, Floats
from pdtui.stimulation.maps import Measured

_KEPT = 0.7
_TRIED = 6


@dataclass(frozen=True)
class Steered:
    """What moves one attribute one way.

    Attributes:
        column: of the attribute.
        sign: 1 for up, −1 for down.
        stimulation: one unit, or two.
        measured: change of the attribute, over starts that chose nothing.
        side: largest change of any other attribute, in parts of that attribute's usual spread.
        main: change of this one, in the same measure.
        alone: `side` of the best single unit, where a second one was added to cancel it, else None.
    """

    column: int
    sign: int
    stimulation: Stimulation
    measured: Measured
    side: float
    main: float
    alone: float | None = None


def movable(attributes: Sequence[Attribute], spread: Floats) -> list[int]:
    """Columns that behaviors are proposed for: what the body does, and what varies at all.

    A torque is left out: it is what the policy commands, not what the robot does with it.
    """
    return [
        column
        for column, attribute in enumerate(attributes)
        if attribute.unit != "N m" and np.isfinite(spread[column]) and spread[column] > 0
    ]


def steer(
    prober: Prober,
    columns: Sequence[int],
    spread: Floats,
    screen: Sweep,
    refined: Sweep,
    starts: Sequence[Start],
    steps: int,
) -> tuple[Steered, ...]:
    """Up and down for each attribute that a confirmed unit moves.

    Args:
        prober: measures.
        columns: of the attributes; also those whose side effects count.
        spread: usual standard deviation of every attribute, shape (J,).
        screen: every unit.
        refined: the units to choose from.
        starts: that neither sweep saw. The first half decides whether a second unit is worth it, the other
            half gives the figures.
        steps: control steps of each roll-out.
    """
    found = []
    half = len(starts) // 2
    for column in columns:
        for sign in (1, -1):
            single = _best_single(column, sign, screen, refined)
            if single is None:
                continue
            plans = [single, *_cancelling(single, column, sign, columns, spread, refined)]
            tried = prober.probe(plans, starts[:half], steps=steps)
            best = _choose(tried, column, sign, columns, spread)
            chosen = [plans[best]] if best == 0 else [plans[best], single]
            held = prober.probe(chosen, starts[half:], steps=steps)
            one = _describe(held, chosen, column, sign, columns, spread)
            if one is not None:
                found.append(one)
    return tuple(found)


def _best_single(column: int, sign: int, screen: Sweep, refined: Sweep) -> Stimulation | None:
    """The unit and output that move the attribute that way most surely, inside the unit's safe range."""
    robust = refined.robust(column, float(sign)).copy()
    for row, unit in enumerate(refined.units):
        alive = refined.survived(unit)
        for dose, value in enumerate(refined.values):
            sure = robust[row, dose] > 0 and abs(value) <= alive
            effect = float(np.nanmean(refined.effects[row, dose, :, column])) if sure else 0.0
            if not sure or not exceeds_random(effect, value, column, screen):
                robust[row, dose] = 0.0
    row, dose = (int(index) for index in np.unravel_index(int(np.argmax(robust)), robust.shape))
    if robust[row, dose] <= 0:
        return None
    return Stimulation((refined.units[row],), (refined.values[dose],))


def _cancelling(
    single: Stimulation, column: int, sign: int, columns: Sequence[int], spread: Floats, refined: Sweep
) -> list[Stimulation]:
    """Second units that, if effects add up, keep most of the main effect and undo the side effects."""
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
    for index in ranked[:_TRIED]:
        other, value = (int(number) for number in np.unravel_index(int(index), side.shape))
        values = {single.units[0]: single.values[0], refined.units[other]: refined.values[value]}
        plans.append(Stimulation.of(dict(sorted(values.items()))))
    return plans


def _parts(
    result: Effects, row: int, column: int, sign: int, columns: Sequence[int], spread: Floats
) -> tuple[float, float]:
    """Main and largest side effect of one plan, in parts of the usual spread."""
    mean = np.nan_to_num(result.effects[row]).mean(axis=0) / np.where(spread > 0, spread, 1.0)
    others = [abs(float(mean[other])) for other in columns if other != column]
    return sign * float(mean[column]), max(others, default=0.0)


def _choose(result: Effects, column: int, sign: int, columns: Sequence[int], spread: Floats) -> int:
    """The plan of least side effect among those that keep most of the first one's main effect."""
    main, side = _parts(result, 0, column, sign, columns, spread)
    best, least = 0, _KEPT * side
    for row in range(1, len(result.effects)):
        kept, beside = _parts(result, row, column, sign, columns, spread)
        if not result.falls[row].any() and kept >= _KEPT * main and beside < least:
            best, least = row, beside
    return best


def _describe(
    result: Effects,
    chosen: Sequence[Stimulation],
    column: int,
    sign: int,
    columns: Sequence[int],
    spread: Floats,
) -> Steered | None:
    samples, falls = result.effects[0, :, column], result.falls[0]
    low, high = bootstrap_interval(samples, 0)
    if not (sign * low > 0 and sign * high > 0) or falls.mean() > 0.2:
        return None
    main, side = _parts(result, 0, column, sign, columns, spread)
    alone = None if len(chosen) == 1 else _parts(result, 1, column, sign, columns, spread)[1]
    measured = Measured(float(np.nanmean(samples)), low, high, int(falls.sum()), len(falls))
    return Steered(column, sign, chosen[0], measured, side, main, alone)
