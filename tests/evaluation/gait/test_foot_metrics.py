"""Figures of gaits against signals made by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdtui.evaluation.gait.foot_metrics import (
    compute_foot_metrics,
    find_touchdowns,
    measure_alternation,
    measure_clearances,
    measure_tilt,
    measure_walking_speed,
    time_share_by_feet_down,
    undo_contact_delays,
)


def _contacts(*feet: str) -> np.ndarray:
    """Return contacts from one text per foot, in which # is contact."""
    return np.array([[mark == "#" for mark in foot] for foot in feet]).T


def test_a_touchdown_is_the_first_step_of_a_contact() -> None:
    touchdowns = find_touchdowns(_contacts("##..##..#"))
    assert np.flatnonzero(touchdowns[:, 0]).tolist() == [4, 8]


def test_the_figures_of_a_foot() -> None:
    contact = _contacts("##..##..###")[:, 0]
    height = np.array([0.0, 0.0, 0.1, 0.2, 0.1, 0.1, 0.3, 0.2, 0.0, 0.0, 0.0])
    sole_speed = np.array([0.5, 9.0, 9.0, 9.0, 0.1, 9.0, 9.0, 9.0, 0.3, 0.3])
    foot = compute_foot_metrics(contact, height, sole_speed, 0.1)
    assert foot.touchdown_rate == pytest.approx(2.0)  # 2 in 10 intervals of 0.1 s
    assert foot.duty_factor == pytest.approx(7 / 11)
    assert foot.clearance == pytest.approx(0.2)  # 0.2 above 0.0, then 0.3 above 0.1
    assert foot.slip == pytest.approx((0.5 + 0.1 + 0.3 + 0.3) / 4)


def test_swings_that_the_walk_cuts_off_have_no_clearance() -> None:
    contact = _contacts("..##..")[:, 0]
    assert len(measure_clearances(contact, np.arange(6.0))) == 0
    foot = compute_foot_metrics(np.zeros(6, bool), np.ones(6), np.ones(5), 0.1)
    assert math.isnan(foot.clearance)
    assert math.isnan(foot.slip)
    assert (foot.touchdown_rate, foot.duty_factor) == (0.0, 0.0)


def test_the_time_is_shared_out_by_the_number_of_feet_on_the_ground() -> None:
    shares = time_share_by_feet_down(_contacts("##..", "#.#."))
    np.testing.assert_allclose(shares, [0.25, 0.5, 0.25])


@pytest.mark.parametrize(
    ("feet", "share"),
    [
        ((".#...#...#..", "...#...#...#"), 1.0),  # left, right, left, …
        ((".#.#.#.#", "........"), 0.0),  # hops on one leg
        ((".#.#.#.#", ".#.#.#.#"), 0.0),  # hops on both
        ((".#.#...#.#..", "......#....#"), 3 / 5),  # one, one, other, one, one, other
    ],
)
def test_feet_alternate_if_each_touchdown_follows_one_of_the_other_foot(
    feet: tuple[str, str], share: float
) -> None:
    assert measure_alternation(_contacts(*feet)) == pytest.approx(share)


def test_one_touchdown_cannot_alternate() -> None:
    assert math.isnan(measure_alternation(_contacts(".#..", "....")))


def test_contacts_that_are_reported_late_are_moved_back() -> None:
    aligned = undo_contact_delays(_contacts(".##.", "..#."), (0, 1))
    np.testing.assert_array_equal(aligned, _contacts(".##", ".#."))


def test_swaying_is_no_walking() -> None:
    seconds = np.arange(0.0, 5.0, 0.02)
    sways = np.stack([2.0 * seconds, 0.3 * np.sin(2 * np.pi * seconds)], axis=1)
    assert measure_walking_speed(sways, 0.02) == pytest.approx(2.0)


def test_a_trunk_that_rolls_and_yaws_is_tilted_by_the_roll() -> None:
    roll = np.array([math.cos(0.1), math.sin(0.1), 0.0, 0.0])
    yawed = np.array([math.cos(0.7) * roll[0], math.cos(0.7) * roll[1], math.sin(0.7) * roll[1], 0.0])
    yawed[3] = math.sin(0.7) * roll[0]
    assert measure_tilt(np.array([roll, yawed])) == pytest.approx(0.2)
