"""How well the policies of a study walk and can be steered by single units, by one score."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.study.matching.matching_study_plan import StudiedPolicy
from pdtui.study.matching.study_data import ROLES, MatchingStudyData, MeasuredUnits, PolicyFacts

STEERED_ATTRIBUTES = ("vx", "vy", "yaw rate", "height", "pitch")
"""What somebody who steers wants to change, as far as the robot has it."""
FULL_EFFECT = 1.0
"""Change of an attribute that counts in full, in standard deviations of the walk."""
SCORE_SENTENCE = (
    "The score is walking times steering. Walking is the share of walks without a failure, times the net "
    "speed over that of the robot's fastest policy. Steering is the mean, over both directions of "
    f"{', '.join(STEERED_ATTRIBUTES[:-1])} and {STEERED_ATTRIBUTES[-1]} "
    "(those that the robot has), of how far the one unit that moved the attribute most on the choosing start "
    "moves it on the held-out starts, in standard deviations of the walk, from 0 to 1; a fall counts as no "
    "change."
)


@dataclass(frozen=True)
class SteerabilityScore:
    """The score of one policy.

    Attributes:
        policy: Its recipe.
        walking: Share of walks without a failure, times the speed over that of the robot's fastest policy.
        attributes: Steering of each of `STEERED_ATTRIBUTES` that was measured: the mean of both directions.
        halves: Steering on the first and on the second half of the held-out starts; NaN for a policy that
            was not probed, because it does not walk.
        steering: Steering on all of them; 0 for such a policy.
    """

    policy: StudiedPolicy
    walking: float
    attributes: dict[str, float]
    halves: tuple[float, float]
    steering: float

    @property
    def score(self) -> float:
        """Walking times steering."""
        return self.walking * self.steering


def score_steerability(data: MatchingStudyData) -> tuple[SteerabilityScore, ...]:
    """Return the scores of the policies of robots with several, the best of each robot first.

    Only units drawn at random can be chosen: every policy has the same number of them, whatever matches.
    """
    recipes = {one.name: one for one in data.plan.policies}
    robots: dict[str, list[PolicyFacts]] = defaultdict(list)
    for one in data.policies:
        if one.name in recipes:
            robots[recipes[one.name].robot].append(one)
    scores: list[SteerabilityScore] = []
    for facts in robots.values():
        if len(facts) < 2:
            continue
        fastest = max(one.net_speed for one in facts)
        of_robot = [
            _score_policy(recipes[one.name], one, fastest, _steered(data.measured, one.name)) for one in facts
        ]
        scores += sorted(of_robot, key=lambda one: one.score, reverse=True)
    return tuple(scores)


def _steered(measured: Iterable[MeasuredUnits], policy: str) -> list[MeasuredUnits]:
    return [one for one in measured if one.policy == policy and one.attribute in STEERED_ATTRIBUTES]


def _score_policy(
    recipe: StudiedPolicy, facts: PolicyFacts, fastest: float, measured: Sequence[MeasuredUnits]
) -> SteerabilityScore:
    share = max(facts.net_speed, 0.0) / fastest if fastest > 0.0 else 0.0
    walking = (1.0 - facts.failures) * share
    if not measured:
        return SteerabilityScore(recipe, walking, {}, (float("nan"), float("nan")), 0.0)
    found = {one.attribute: _steering(one) for one in measured}
    both, first, second = np.mean(list(found.values()), axis=0).tolist()
    attributes = {name: found[name][0] for name in STEERED_ATTRIBUTES if name in found}
    return SteerabilityScore(recipe, walking, attributes, (first, second), both)


def _steering(one: MeasuredUnits) -> tuple[float, float, float]:
    """Return the steering of one attribute on all held-out starts, on their first and their second half."""
    drawn = one.roles != ROLES.index("matched")
    rows = []
    for direction in (1.0, -1.0):
        choosing, first, second = direction * one.effects[:, :, drawn]
        best = np.unravel_index(np.argmax(choosing), choosing.shape)
        rows.append([(first[best] + second[best]) / 2, first[best], second[best]])
    both, half, other = np.clip(np.array(rows) / FULL_EFFECT, 0.0, 1.0).mean(axis=0).tolist()
    return both, half, other


def score_headers() -> list[str]:
    """Return the headings of `score_rows`."""
    return ["policy", "trained by", "walking", *STEERED_ATTRIBUTES, "steering (halves)", "score"]


def score_rows(scores: Iterable[SteerabilityScore]) -> list[tuple[str, ...]]:
    """Return one row of text for each policy."""
    return [
        (
            one.policy.name,
            one.policy.training,
            f"{one.walking:.2f}",
            *(
                f"{one.attributes[name]:.2f}" if name in one.attributes else "–"
                for name in STEERED_ATTRIBUTES
            ),
            f"{one.steering:.2f} ({one.halves[0]:.2f}, {one.halves[1]:.2f})" if one.attributes else "–",
            f"{one.score:.2f}",
        )
        for one in scores
    ]


def describe_best_and_shipped(scores: Sequence[SteerabilityScore]) -> str:
    """Return, in one sentence for each robot, the place of its shipped policy among those scored."""
    robots: dict[str, list[SteerabilityScore]] = defaultdict(list)
    for one in scores:
        robots[one.policy.robot].append(one)
    return " ".join(_describe_best(robot, of_robot) for robot, of_robot in robots.items())


def _describe_best(robot: str, scores: Sequence[SteerabilityScore]) -> str:
    best = scores[0]
    said = f"Of {len(scores)} policies of `{robot}`, `{best.policy.name}` scores best, {best.score:.2f}"
    place = next((number for number, one in enumerate(scores, 1) if one.policy.shipped), None)
    if place is None:
        return f"{said}; the shipped one was not measured."
    if place == 1:
        return f"{said}; it is the shipped one."
    return f"{said}; the shipped one is number {place}, with {scores[place - 1].score:.2f}."
