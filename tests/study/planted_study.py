"""Data of a matching study in which it is known whether matching finds what steers."""

from __future__ import annotations

import numpy as np

from pdtui.study.matching.matching_study_plan import MatchingStudyPlan, parse_matching_study_plan
from pdtui.study.matching.study_data import ROLES, MatchingStudyData, MeasuredUnits, PolicyFacts

PLAN = """
[walking]
seeds = "500-501"
steps = 120
most_failures = 0.5
least_speed = { walker = 1.0 }
[monitoring]
seeds = "4000-4001"
steps = 100
[probing]
values = [-3.0, 3.0]
steps = 12
earliest_start = 10
latest_start = 20
choosing_starts = 1
choosing_seed = 4100
held_out_starts = 2
held_out_seed = 700
reference_units = 12
random_units = 6
best = 2
seed = 4000
[matching]
presets = ["paper"]
primary = "paper, scaled"
[matching.variants]
scaled = []
"level removed" = ["level=removed"]
[statistics]
quantile = 0.9
level = 0.05
enough = 0.5
resamples = 200
[[policies]]
robot = "walker"
algorithm = "ppo"
activation = "tanh"
layers = [256, 256]
seeds = [1000, 1001, 1002]
steps = 5000
imitation_rounds = 0
"""
UNITS = 200


def small_plan() -> MatchingStudyPlan:
    """Return a plan of three policies of the Walker that is measured in seconds."""
    return parse_matching_study_plan(PLAN, "small plan")


def plant_study(policies: int, share: float, seed: int = 0, attributes: int = 6) -> MatchingStudyData:
    """Return data in which the best matches are the strongest units for a share of the attributes.

    For the others, a unit matches whatever it does. The phase tells the sign of the direction as often.
    """
    rng, plan = np.random.default_rng(seed), small_plan()
    facts, measured = [], []
    for number in range(policies):
        name = f"planted-{number}"
        facts.append(PolicyFacts(name, "planted", "none", "trained", "0", 100.0, 2.0, 0.0, True, UNITS, 10))
        for column in range(attributes):
            strength = rng.exponential(size=UNITS)
            direction = rng.choice([-1.0, 1.0], UNITS)
            good = rng.random() < share
            order = np.argsort(-strength) if good else rng.permutation(UNITS)
            ranks = np.empty(UNITS, np.uint16)
            ranks[order] = np.arange(UNITS)
            signs = direction if good else rng.choice([-1.0, 1.0], UNITS)
            effect = strength * direction + rng.normal(scale=0.01, size=(3, UNITS))
            roles = np.full(UNITS, ROLES.index("matched"), np.uint8)
            drawn = rng.permutation(UNITS)
            roles[drawn[:80]], roles[drawn[80:120]] = ROLES.index("reference"), ROLES.index("random")
            measured.append(
                MeasuredUnits(
                    name,
                    f"attribute {column}",
                    np.arange(UNITS, dtype=np.uint16),
                    roles,
                    np.stack([-effect, effect], axis=1),
                    np.stack([ranks, ranks]),
                    np.stack([0.8 * signs, 0.8 * signs]),
                )
            )
    return MatchingStudyData(plan, tuple(facts), tuple(measured))
