"""What a person would call it: the criterion that a run with a behavior must meet, by its name and its aim.

A word in a behavior's name promises something. A *spin* is two full turns. A behavior that changes the yaw
rate is a heading that goes on turning, and one that changes a velocity of a robot that has two is a course.
Any other behavior is taken by its aim alone, and so is one that calls itself a *drift*.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pdtui.core.attributes import Attribute, BehaviorAim, Floats
from pdtui.evaluation.held_run import HeldRunTrace
from pdtui.evaluation.protocol_settings import RunTimes

TURNS = 2.0
"""Full turns of a spin."""
TURN_RATE = 0.15
"""Slowest mean yaw rate that counts as turning, rad/s: 43° in 5 s, which one sees."""
STAND_SPEED = 0.1
"""Fastest mean speed that counts as standing, m/s."""
STAND_DRIFT = 0.25
"""Longest way in the last window that counts as standing, m."""
STAND_SHARE = 0.05
"""Largest share of the default's value that counts as near 0, for attributes that are no speeds."""
COURSE = 45.0
"""Largest angle between the course and the direction that a name promises, degrees."""
_WORDS = re.compile(r"[a-z]+")


@dataclass(frozen=True)
class JudgedRun:
    """A run, the run of the same seed without a press, and how to read them."""

    trace: HeldRunTrace
    default: HeldRunTrace
    times: RunTimes
    attributes: Sequence[Attribute]

    def column(self, name: str) -> int | None:
        """Return the column of an attribute; None if the robot lacks it."""
        names = [attribute.name for attribute in self.attributes]
        return names.index(name) if name in names else None

    def last(self, name: str, *, default: bool = False) -> float:
        """Return the mean of an attribute over the last window."""
        values = (self.default if default else self.trace).values
        return float(values[self.times.last_bins, self.column(name)].mean())

    def turned(self, rate: str) -> Floats:
        """Return the angle turned since the press at each bin of the hold, rad."""
        yaw, held = self.column("yaw"), self.times.held_bins
        if yaw is not None and rate == "yaw rate":
            angles: Floats = self.trace.values[:held, yaw]
            turned: Floats = angles - angles[0]
            return turned
        summed: Floats = np.cumsum(self.trace.values[:held, self.column(rate)]) * self.times.bin_seconds
        return summed

    def drift(self) -> float:
        """Return how far the first body is at the end of the last window from where it began it, m."""
        places = self.trace.places[self.times.last_bins]
        return float(np.hypot(*(places[-1] - places[0])))


@dataclass(frozen=True)
class BehaviorCriterion:
    """What a run must show.

    Attributes:
        words: The criterion, for tables.
        quantity: What is measured, with its unit.
        measure: Measures it in a run; NaN where the run has ended.
        judge: Tells whether a run that does not fail meets it.
    """

    words: str
    quantity: str
    measure: Callable[[JudgedRun], float]
    judge: Callable[[JudgedRun], bool]

    def is_met(self, run: JudgedRun) -> bool:
        """Return whether a run meets the criterion and does not fail before the release."""
        ended_at = run.trace.ended_at
        failed = run.trace.failed and ended_at is not None and ended_at < run.times.held
        return not failed and bool(self.judge(run))


def choose_criterion(name: str, aim: BehaviorAim, attributes: Sequence[Attribute]) -> BehaviorCriterion:
    """Return the criterion of a behavior.

    Args:
        name: Its name, whose words decide.
        aim: Its aim.
        attributes: The robot's attributes.
    """
    words, known = set(_WORDS.findall(name.lower())), {one.name: one for one in attributes}
    unit = known[aim.attribute].unit if aim.attribute in known else ""
    if aim.direction == "stop":
        return _stand(aim.attribute, unit)
    directed = aim.direction in ("increase", "decrease")
    if directed and aim.attribute.endswith("yaw rate"):
        return _spin(aim) if "spin" in words else _turn(aim)
    if directed and aim.attribute in ("vx", "vy") and {"vx", "vy"} <= known.keys() and "drift" not in words:
        return _course(aim)
    return _beyond_zero(aim, unit) if directed else _beyond_default(aim, unit)


def _side(aim: BehaviorAim) -> str:
    return "left" if aim.sign > 0 else "right"


def _spin(aim: BehaviorAim) -> BehaviorCriterion:
    def count_turns(run: JudgedRun) -> float:
        turned = aim.sign * run.turned(aim.attribute)
        return float(turned[np.isfinite(turned)].max(initial=0.0)) / (2.0 * np.pi)

    words = f"two full turns to the {_side(aim)}"
    return BehaviorCriterion(words, "turns", count_turns, lambda run: count_turns(run) >= TURNS)


def _turn(aim: BehaviorAim) -> BehaviorCriterion:
    def rate(run: JudgedRun) -> float:
        turned = run.turned(aim.attribute)[run.times.last_bins]
        return float(turned[-1] - turned[0]) / ((len(turned) - 1) * run.times.bin_seconds)

    words = f"still turns {_side(aim)} by {TURN_RATE} rad/s in the last 5 s"
    return BehaviorCriterion(words, "rad/s", rate, lambda run: aim.sign * rate(run) >= TURN_RATE)


def _stand(attribute: str, unit: str) -> BehaviorCriterion:
    def left(run: JudgedRun) -> float:
        return abs(run.last(attribute))

    def judge_stand(run: JudgedRun) -> bool:
        return left(run) < STAND_SPEED and not run.drift() > STAND_DRIFT  # NaN without poses

    def judge_share(run: JudgedRun) -> bool:
        return left(run) < STAND_SHARE * abs(run.last(attribute, default=True))

    if unit != "m/s":
        words = f"under {STAND_SHARE:.0%} of the default in the last 5 s"
        return BehaviorCriterion(words, unit, left, judge_share)
    words = f"stands in the last 5 s: under {STAND_SPEED} m/s, within {STAND_DRIFT} m"
    return BehaviorCriterion(words, unit, left, judge_stand)


def _course(aim: BehaviorAim) -> BehaviorCriterion:
    axis = ("vx", "vy").index(aim.attribute)

    def velocity(run: JudgedRun) -> Floats:
        return np.array([run.last("vx"), run.last("vy")])

    def off(run: JudgedRun) -> float:
        along, across = aim.sign * velocity(run)[axis], velocity(run)[1 - axis]
        return float(np.degrees(np.arctan2(abs(across), along)))

    def judge(run: JudgedRun) -> bool:
        return bool(np.hypot(*velocity(run)) > STAND_SPEED) and off(run) <= COURSE

    sign = "+" if aim.sign > 0 else "−"
    words = f"course within {COURSE:.0f}° of {sign}{aim.attribute[1]} in the last 5 s"
    return BehaviorCriterion(words, "° off", off, judge)


def _beyond_zero(aim: BehaviorAim, unit: str) -> BehaviorCriterion:
    sign = ">" if aim.sign > 0 else "<"
    return BehaviorCriterion(
        f"{aim.attribute} {sign} 0 and {sign} the default's in the last 5 s",
        unit,
        lambda run: run.last(aim.attribute),
        lambda run: aim.sign * run.last(aim.attribute) > 0.0 and _beats_default(run, aim),
    )


def _beyond_default(aim: BehaviorAim, unit: str) -> BehaviorCriterion:
    sign = ">" if aim.sign > 0 else "<"
    return BehaviorCriterion(
        f"{aim.attribute} {sign} the default's in the last 5 s",
        unit,
        lambda run: run.last(aim.attribute),
        partial(_beats_default, aim=aim),
    )


def _beats_default(run: JudgedRun, aim: BehaviorAim) -> bool:
    default = run.last(aim.attribute, default=True)
    # A default that has ended proves nothing, so only the sign of what is there counts.
    return aim.sign * (run.last(aim.attribute) - (0.0 if np.isnan(default) else default)) > 0.0
