"""Gathers what the methods of a steering comparison try, from what a dissection has found so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pdtui.dissection.steering.linear_probes import LinearProbe
from pdtui.dissection.steering.observation_edit_directions import (
    ObservationEditDirection,
    fit_edit_direction,
    sample_walk_observations,
)
from pdtui.dissection.steering.steering_candidates import (
    SteeringCandidate,
    SteeringMethod,
    affine_candidates,
    direction_candidates,
    edit_direction_candidates,
    observation_edit_candidates,
    pair_candidates,
    random_direction_candidates,
    smallest_tried_edit_size,
    unit_candidates,
)
from pdtui.dissection.steering.steering_comparison import SteeringSettings
from pdtui.policies.runtime.policy import Policy
from pdtui.probing.measured_effects import UnitEffects
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.robots.robot import Robot
from pdtui.spectra.matching import UnitDiscrepancies


def fit_edit_directions(robot: Robot, policy: Policy, seed: int) -> dict[str, ObservationEditDirection]:
    """Return the direction in the first layer of each edit that a robot offers, at its smallest size."""
    edits = [one for one in robot.observation_edits if one.dissected]
    observations = sample_walk_observations(robot, policy, seed) if edits else []
    return {
        one.name: fit_edit_direction(policy, observations, edits, {one.name: smallest_tried_edit_size(one)})
        for one in edits
    }


def gather_steering_candidates(
    matching: UnitDiscrepancies,
    refined: UnitEffects,
    probes: Sequence[LinearProbe],
    edits: Sequence[ObservationEdit],
    edit_directions: Mapping[str, ObservationEditDirection],
    layers: Sequence[int],
    columns: Sequence[int],
    settings: SteeringSettings,
    seed: int,
) -> list[SteeringCandidate]:
    """Return all candidates.

    Args:
        matching: Whose first matches of an attribute are its *matched units*.
        refined: Effects, whose strongest units of an attribute are its *probed units*.
        probes: Linear probes of the attributes.
        edits: What the robot offers to edit of its observation.
        edit_directions: Directions of edits of the smallest size, by the edit's name.
        layers: Widths of the policy's hidden layers.
        columns: Columns of the attributes.
        settings: Doses, and how many of each.
        seed: Seed of what is drawn at random.
    """
    values, lengths, readings, factors = (
        [sign * size for size in sizes for sign in (1.0, -1.0)]
        for sizes in (settings.values, settings.lengths, settings.readings, settings.factors)
    )
    rng = np.random.default_rng(seed)
    found: list[SteeringCandidate] = []
    for column in columns:
        matched = matching.ranked_units(column)[: settings.sources].tolist()
        found += unit_candidates(SteeringMethod.MATCHED_UNIT, column, matched, values, layers)
        probed: dict[int, None] = {}
        for sign in (1.0, -1.0):
            strongest = _strongest_units(refined, column, sign, settings.half)
            probed |= {unit: None for unit, _ in strongest}
            found += pair_candidates(column, strongest, settings.values, layers)
        found += unit_candidates(SteeringMethod.PROBED_UNIT, column, list(probed), values, layers)
    for probe in probes:
        found += direction_candidates(probe, lengths)
        found += affine_candidates(probe, readings)
    tried = [one for one in edits if one.dissected]
    found += observation_edit_candidates(tried, factors)
    found += edit_direction_candidates(tried, edit_directions, factors)
    drawn = rng.choice(sum(layers), size=min(settings.sources, sum(layers)), replace=False).tolist()
    found += unit_candidates(SteeringMethod.RANDOM_UNIT, None, drawn, values, layers)
    spreads = {probe.layer: probe.layer_spread for probe in probes}
    for layer, spread in spreads.items():
        count = max(1, settings.sources // len(spreads))
        found += random_direction_candidates(layer, layers[layer], spread, count, lengths, rng)
    return found


def _strongest_units(refined: UnitEffects, column: int, sign: float, count: int) -> list[tuple[int, float]]:
    """Return the units that move an attribute that way most reliably, with the sign of their outputs."""
    robust = refined.robust_effects(column, sign)
    best = robust.max(axis=1)
    rows = [int(row) for row in np.argsort(-best, kind="stable")[:count] if best[row] > 0]
    return [(refined.units[row], 1.0 if refined.values[robust[row].argmax()] >= 0 else -1.0) for row in rows]
