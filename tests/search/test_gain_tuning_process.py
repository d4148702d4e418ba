"""Tuning beside a drive, in a process of its own."""

from __future__ import annotations

import time

from pdtui.driving.drive_config import DriveConfig
from pdtui.search.gains.gain_tuning_process import GainTuningProcess
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.waiting import wait_until_over


def test_the_maps_gains_are_among_those_offered_and_a_fixed_behavior_has_none(
    small_map: StimulationMap,
) -> None:
    with GainTuningProcess(DriveConfig("ant", small_map, seed=3), minutes=0.01) as tuning:
        assert tuning.tune("hold heading") == ""
        assert "under way" in tuning.tune("hold heading")
        state = wait_until_over(lambda: tuning.state)
        assert (state.condition, state.behavior) == ("done", "hold heading")
        assert state.tried >= 1
        assert small_map.behaviors["hold heading"].pid in [one.pid for one in state.offered]
        assert all(one.drives == 5 and 0 <= one.failures <= 5 for one in state.offered)
        while tuning.tune("push"):
            time.sleep(0.01)
        failed = wait_until_over(lambda: tuning.state)
        assert failed.condition == "failed"
        assert "behavior 'push': expected mode pid" in failed.message
