"""What a replay on another machine is told."""

from __future__ import annotations

from pdtui.sessions.environment_versions import collect_versions, list_version_differences


def test_the_same_place_does_not_differ() -> None:
    assert list_version_differences(collect_versions(), collect_versions()) == []


def test_differences_name_both_sides() -> None:
    there = {"numpy": "2.2.0", "mujoco": "4.0.0", "torch": "2.6"}
    here = {"numpy": "2.3.1", "mujoco": "4.0.0", "blas": "mkl"}
    assert list_version_differences(there, here) == [
        "numpy: 2.2.0 there, 2.3.1 here",
        "torch: 2.6 there, absent here",
        "blas: absent there, mkl here",
    ]


def test_the_simulators_of_all_robots_are_named() -> None:
    assert {"mujoco", "box2d"} <= collect_versions().keys()
    there = {**collect_versions(), "pybullet": "3.2.6", "box2d": "2.3.9"}
    differences = list_version_differences(there, collect_versions(), numeric=True)
    # From Python 3.12 on, there is no pybullet.
    assert {line.partition(":")[0] for line in differences} == {"pybullet", "box2d"}


def test_a_package_that_an_older_session_does_not_name_is_no_difference() -> None:
    there = {name: found for name, found in collect_versions().items() if name != "box2d"}
    assert list_version_differences(there, collect_versions()) == []
