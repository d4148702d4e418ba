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
