"""Tuning beside a drive, in a process of its own."""

from __future__ import annotations

import time

from pdtui.driving.drive_config import DriveConfig
from pdtui.search.gain_tuning_process import GainTuningProcess, GainTuningState
from pdtui.stimulation.stimulation_map import StimulationMap

PATIENCE = 240.0


def wait_until_over(tuning: GainTuningProcess) -> GainTuningState:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        state = tuning.state
        if state is not None and state.condition in ("done", "failed"):
            return state
        time.sleep(0.02)
    raise AssertionError(f"the tuning was not over in {PATIENCE:g} s: {tuning.state}")


def test_the_maps_gains_are_among_those_offered_and_a_fixed_behavior_has_none(
    small_map: StimulationMap,
) -> None:
    with GainTuningProcess(DriveConfig("ant", small_map, seed=3), minutes=0.01) as tuning:
        assert tuning.tune("hold heading") == ""
        assert "under way" in tuning.tune("hold heading")
        state = wait_until_over(tuning)
        assert (state.condition, state.behavior) == ("done", "hold heading")
        assert state.tried >= 1
        assert small_map.behaviors["hold heading"].pid in [one.pid for one in state.offered]
        assert all(one.drives == 5 and 0 <= one.failures <= 5 for one in state.offered)
        while tuning.tune("push"):
            time.sleep(0.01)
        failed = wait_until_over(tuning)
        assert failed.condition == "failed"
        assert "behavior 'push': expected mode pid" in failed.message
