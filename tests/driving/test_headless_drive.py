"""What a drive without a screen counts."""

from __future__ import annotations

from pdtui.driving.drive_arrays import collect_drive_arrays
from pdtui.driving.headless_drive import drive_headless
from tests.road import road_loop

KEYS = {41: ["a"], 63: ["d"], 85: ["b"], 160: ["space"]}


def test_a_drive_counts_how_episodes_ended_the_cost_and_the_operators_part() -> None:
    summary = drive_headless(road_loop(), KEYS, 200, None)
    assert summary.outcomes == {"arrived": 2, "crashed": 1, "left the road": 1, "out of time": 1}
    assert summary.cost == 0.5 * 58  # of each step from the key to the end of that episode
    assert summary.involvement == 4


def test_a_trajectory_says_it_step_by_step() -> None:
    drive = collect_drive_arrays(road_loop(), KEYS, 100)
    assert drive.outcomes == {39: "arrived", 61: "left the road", 82: "crashed"}
    assert repr(drive).endswith("3 events, arrived 1, crashed 1, left the road 1>")
