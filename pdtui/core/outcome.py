"""How an episode ended, in one word: the world says it, and whatever counts or judges episodes asks it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Any

from pdtui.core.errors import RobotError


class Outcome(StrEnum):
    """How an episode ended, or that its task is done although it goes on."""

    ARRIVED = "arrived"
    FELL = "fell"
    CRASHED = "crashed"
    LEFT_ROAD = "left the road"
    OUT_OF_TIME = "out of time"
    DIVERGED = "diverged"


OutcomeCounts = dict[Outcome, int]
"""Number of episodes by outcome. A zero means that the outcome was possible but did not occur."""


def is_failure(outcome: Outcome | None) -> bool:
    """Return whether an outcome is a failure: neither arrived nor out of time. None, for none, is not."""
    return outcome not in (None, Outcome.ARRIVED, Outcome.OUT_OF_TIME)


def outcome_of_step(terminated: bool, truncated: bool, info: Mapping[str, Any], robot: str) -> Outcome | None:
    """Return the outcome of an episode after one of its control steps; None while there is none.

    The word is that of the world, ``outcome`` in the info of the step. A world that says nothing has arrived
    if the info says ``finished`` or, as in many environments, ``is_success``; otherwise, an episode that
    terminates ends with a fall, and one that is truncated is out of time.

    Raises:
        RobotError: The word is no outcome, or is said while the episode goes on and is not ``arrived``. The
            message names the robot.
    """
    word = info.get("outcome")
    if word is None:
        if info.get("finished", info.get("is_success", False)):
            return Outcome.ARRIVED
        return Outcome.FELL if terminated else Outcome.OUT_OF_TIME if truncated else None
    if not isinstance(word, str) or word not in list(Outcome):
        known = ", ".join(f"'{one}'" for one in Outcome)
        raise RobotError(f"{robot}: 'outcome' in the info of a step: expected one of {known}, found {word!r}")
    outcome = Outcome(word)
    if outcome is not Outcome.ARRIVED and not (terminated or truncated):
        raise RobotError(
            f"{robot}: 'outcome' in the info of a step: expected '{Outcome.ARRIVED}' or nothing while the "
            f"episode goes on, found '{outcome}'"
        )
    return outcome


def fall_info(reason: str) -> dict[str, Any]:
    """Return what the info of a step says of a fall: the outcome and the reason; nothing without a reason."""
    return {"outcome": Outcome.FELL, "reason": reason} if reason else {}


def count_outcomes(outcomes: Iterable[Outcome | None], possible: Iterable[Outcome] = ()) -> OutcomeCounts:
    """Count outcomes, in the order of `Outcome`, and leave out None.

    Those that are possible are in the counts even if none occurred.
    """
    found = list(outcomes)
    return {one: found.count(one) for one in Outcome if one in {*possible, *found}}


def count_failures(counts: Mapping[Outcome, int]) -> int:
    """Return the number of episodes that failed."""
    return sum(number for outcome, number in counts.items() if is_failure(outcome))


def failure_noun(counts: Mapping[Outcome, int]) -> str:
    """Return what the failures of a robot are called in tables: falls, if it can fall."""
    return "falls" if Outcome.FELL in counts or not counts else "failures"


def describe_outcomes(counts: Mapping[Outcome, int], total: int | None = None) -> str:
    """Return counts in words: ``arrived 18 of 20, crashed 1``, or ``falls 1 of 20`` if nothing else occurs.

    Args:
        counts: The counts.
        total: Number of episodes; None leaves it out.
    """
    of = "" if total is None else f" of {total}"
    if Outcome.ARRIVED not in counts and not _others_occur(counts):
        return f"falls {counts.get(Outcome.FELL, 0)}{of}"
    shown = [one for one in Outcome if counts.get(one) or (one is Outcome.ARRIVED and one in counts)]
    return ", ".join(f"{one} {counts[one]}{of if one is shown[0] else ''}" for one in shown)


def format_failures(counts: Mapping[Outcome, int], total: int) -> str:
    """Return failures as a share, ``3/20``, with the words of all outcomes if they are not only falls."""
    share = f"{count_failures(counts)}/{total}"
    if not _others_occur(counts):
        return share
    return f"{share} ({', '.join(f'{one} {counts[one]}' for one in Outcome if counts.get(one))})"


def _others_occur(counts: Mapping[Outcome, int]) -> bool:
    """Return whether there is an outcome that is no fall."""
    return any(number for outcome, number in counts.items() if outcome is not Outcome.FELL)
