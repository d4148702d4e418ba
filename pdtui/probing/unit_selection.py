"""Choose the units that are probed further, from effects on starts that will not judge them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.units import Stimulation
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.measured_effects import UnitEffects
from pdtui.robots.robot import Robot
from pdtui.spectra.matching import UnitDiscrepancies

RANDOM_QUANTILE = 0.9
"""A unit exceeds random units if it moves the attribute more than this share of all units does."""
_ENOUGH = 0.7
"""Share of how far a unit stands out at most that a smaller output has to reach to be preferred."""
_LEAST_EFFECT = 1e-9
"""Effect, in the attribute's unit, below which nothing is measured."""
_OBSERVED_STEPS, _STEPS_APART = 60, 10
"""Control steps of the walk on which actions are compared, and steps from one comparison to the next."""


@dataclass(frozen=True)
class PrimitiveCandidate:
    """A unit that may move an attribute, chosen before it is judged.

    Attributes:
        unit: flat index.
        column: column of the attribute.
        value: output v that moved the attribute most, among those that are judged.
        sign: 1 if the attribute rose, −1 if it fell.
    """

    unit: int
    column: int
    value: float
    sign: float


def select_outputs_by_action_change(
    robot: Robot,
    policy: Policy,
    values: Sequence[float],
    count: int,
    *,
    seed: int,
    options: dict[str, str] | None,
) -> tuple[tuple[int, float], ...]:
    """Choose single units, and outputs v, that push one component of the action most in one direction.

    None is tried on the robot: the policy is asked at observations of an unperturbed walk.

    Args:
        robot: The robot, which walks to observe.
        policy: The policy.
        values: Outputs that each unit is given.
        count: Number of units and outputs, shared by the components and their two directions.
        seed, options: Those of the robot's reset.

    Returns:
        Flat indices and outputs.
    """
    changes = _action_changes(robot, policy, values, seed, options)
    components = changes.shape[2]
    each = max(1, count // (2 * components))
    chosen: dict[tuple[int, float], None] = {}
    for component in range(components):
        for sign in (1.0, -1.0):
            pushed = sign * changes[:, :, component]
            best = pushed.argmax(axis=1)
            order = np.argsort(-pushed.max(axis=1), kind="stable")[:each]
            chosen |= {(unit, values[best[unit]]): None for unit in order.tolist()}
    return tuple(chosen)


def _action_changes(
    robot: Robot, policy: Policy, values: Sequence[float], seed: int, options: dict[str, str] | None
) -> NDArray[np.float64]:
    """Return the mean change of the action by each unit at each output, shape (U, values, A)."""
    observation, _ = robot.reset(seed=seed, options=options)
    policy.reset()
    seen = []
    for step in range(_OBSERVED_STEPS):
        action = policy.act(observation).action
        if step % _STEPS_APART == 0:
            seen.append((observation, action))
        observation, _, ends = robot.step_without_reward(action)
        if ends:
            break
    changes = np.zeros((policy.units, len(values), len(seen[0][1])))
    for unit in range(policy.units):
        for number, value in enumerate(values):
            stimulation = Stimulation.of({unit: value})
            moved = [policy.act(one, stimulation).action - action for one, action in seen]
            changes[unit, number] = np.mean(moved, axis=0)
    return changes


def select_units_to_refine(
    screen: UnitEffects, matching: UnitDiscrepancies, columns: Sequence[int], keep: int
) -> tuple[int, ...]:
    """Choose the first match of each attribute, and the `keep` strongest probed units in each direction."""
    chosen: set[int] = set()
    for column in columns:
        chosen.update(matching.ranked_units(column)[:1].tolist())
        for sign in (1.0, -1.0):
            strengths = screen.robust_effects(column, sign).max(axis=1)
            order = np.argsort(-strengths, kind="stable")[:keep]
            chosen.update(screen.units[row] for row in order if strengths[row] > 0)
    return tuple(sorted(chosen))


def sample_control_units(units: Sequence[int], count: int, seed: int) -> tuple[int, ...]:
    """Draw units at random, whatever they do: a ranking has to beat them."""
    rng = np.random.default_rng(seed)
    chosen = rng.choice(np.array(units), size=min(count, len(units)), replace=False)
    return tuple(sorted(chosen.tolist()))


def choose_primitive_candidates(
    screen: UnitEffects,
    refined: UnitEffects,
    matching: UnitDiscrepancies,
    columns: Sequence[int],
    values: Sequence[float],
    keep: int,
) -> tuple[PrimitiveCandidate, ...]:
    """Choose for each attribute its first match and the `keep` units that stand out most.

    How far a unit stands out is its robust effect, divided by what `RANDOM_QUANTILE` of all screened units
    stay below at such an output: an output that makes half of all units brake singles out no brake. Each unit
    comes with the smallest of its outputs, among those of `values`, at which it stands out nearly as far as
    at any.
    """
    doses = [dose for dose, value in enumerate(refined.values) if value in values]
    candidates = []
    for column in columns:
        robust = np.maximum(refined.robust_effects(column, 1.0), refined.robust_effects(column, -1.0))
        usual = np.array([_random_effect(value, column, screen) for value in refined.values])
        robust = robust / np.maximum(usual, _LEAST_EFFECT)
        strengths = robust[:, doses].max(axis=1)
        order = np.argsort(-strengths, kind="stable")[:keep]
        rows = [int(row) for row in order if strengths[row] > 0]
        first = [refined.units.index(int(unit)) for unit in matching.ranked_units(column)[:1]]
        means = refined.counted_effects()[..., column].mean(axis=-1)
        for row in dict.fromkeys([*first, *rows]):
            # A unit without a reliable effect is judged where its mean effect is largest.
            scores = robust[row] if strengths[row] > 0 else np.abs(means[row])
            enough = [one for one in doses if scores[one] >= _ENOUGH * scores[doses].max()]
            dose = min(enough, key=lambda one: (abs(refined.values[one]), -scores[one]))
            sign = 1.0 if means[row, dose] >= 0 else -1.0
            candidates.append(PrimitiveCandidate(refined.units[row], column, refined.values[dose], sign))
    return tuple(candidates)


def exceeds_random_units(effect: float, value: float, column: int, screen: UnitEffects) -> bool:
    """Return whether an effect exceeds that of `RANDOM_QUANTILE` of all units at the nearest screened |v|."""
    return abs(effect) > _random_effect(value, column, screen)


def _random_effect(value: float, column: int, screen: UnitEffects) -> float:
    """Return what the effects of `RANDOM_QUANTILE` of all units stay below at the nearest screened |v|."""
    magnitude = min((abs(v) for v in screen.values), key=lambda size: abs(size - abs(value)))
    doses = [dose for dose, v in enumerate(screen.values) if abs(v) == magnitude]
    # A fall before the measured steps leaves NaN, which counts as no effect.
    sizes = np.abs(np.nan_to_num(screen.effects[:, doses, :, column]).mean(axis=-1))
    return float(np.quantile(sizes, RANDOM_QUANTILE))
