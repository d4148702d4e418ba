"""The words for how an episode ended, what they are when a world is silent, and how they are counted."""

from __future__ import annotations

from typing import Any

import pytest

from pdtui.core.errors import RobotError
from pdtui.core.outcome import (
    Outcome,
    count_failures,
    count_outcomes,
    describe_outcomes,
    failure_noun,
    format_failures,
    is_failure,
    outcome_of_step,
)

ROAD = (Outcome.ARRIVED, Outcome.CRASHED, Outcome.LEFT_ROAD)


@pytest.mark.parametrize(
    ("terminated", "truncated", "info", "outcome"),
    [
        (False, False, {}, None),
        (True, False, {}, "fell"),
        (False, True, {}, "out of time"),
        (True, False, {"finished": True}, "arrived"),
        (False, False, {"finished": True}, "arrived"),
        (False, True, {"is_success": 1.0}, "arrived"),
        (True, False, {"is_success": 0.0}, "fell"),
        (True, False, {"finished": False, "is_success": True}, "fell"),
        (True, False, {"outcome": "crashed", "finished": True}, "crashed"),
        (False, True, {"outcome": "left the road"}, "left the road"),
        (False, False, {"outcome": "arrived"}, "arrived"),
        (False, False, {"outcome": None}, None),
    ],
)
def test_the_worlds_word_counts_or_else_what_it_means(
    terminated: bool, truncated: bool, info: dict[str, Any], outcome: str | None
) -> None:
    assert outcome_of_step(terminated, truncated, info, "robot") == outcome


@pytest.mark.parametrize("word", ["exploded", "", 3, ["fell"], True])
def test_a_foreign_word_is_named(word: object) -> None:
    with pytest.raises(RobotError, match=r"car: 'outcome' in the info of a step: expected one of 'arrived'"):
        outcome_of_step(True, False, {"outcome": word}, "car")


def test_all_but_arriving_and_running_out_of_time_is_a_failure() -> None:
    failures = [outcome for outcome in Outcome if is_failure(outcome)]
    assert failures == ["fell", "crashed", "left the road", "diverged"]
    assert not is_failure(None)


def test_counts_are_told_by_their_words() -> None:
    found = [Outcome.LEFT_ROAD, *[Outcome.ARRIVED] * 18, Outcome.CRASHED, None]
    counts = count_outcomes(found, ROAD)
    assert counts == {"arrived": 18, "crashed": 1, "left the road": 1}
    assert describe_outcomes(counts, 20) == "arrived 18 of 20, crashed 1, left the road 1"
    assert (count_failures(counts), failure_noun(counts)) == (2, "failures")
    assert format_failures(counts, 20) == "2/20 (arrived 18, crashed 1, left the road 1)"
    assert describe_outcomes(count_outcomes([Outcome.CRASHED], ROAD), 3) == "arrived 0 of 3, crashed 1"


def test_those_of_a_walker_are_falls() -> None:
    counts = count_outcomes([Outcome.FELL, None, Outcome.FELL], [Outcome.FELL])
    assert (describe_outcomes(counts), describe_outcomes(counts, 20)) == ("falls 2", "falls 2 of 20")
    assert (format_failures(counts, 20), failure_noun(counts)) == ("2/20", "falls")
    assert describe_outcomes({}) == "falls 0"
    assert describe_outcomes({Outcome.FELL: 0, Outcome.OUT_OF_TIME: 3}) == "out of time 3"
