"""Spectrograms beside a drive: the same figures as a dissection's, and nothing over a jump."""

from __future__ import annotations

import time

import numpy as np
import pytest

from pdtui.core.attributes import unwrap_angles
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.live_spectra.live_spectra import LiveSpectra, compute_spectra
from pdtui.driving.live_spectra.spectra_snapshot import SpectraChoice, SpectraSnapshot
from pdtui.driving.timeline.past_steps import PastSteps
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import PRESETS
from pdtui.stimulation.stimulation_map import StimulationMap

PAPER = PRESETS["paper"]
EVENTS = {20: [DriveEvent(20, "rewind", value=10.0, key="backspace")]}


@pytest.fixture(scope="module")
def driven(policy: Policy, small_map: StimulationMap) -> tuple[ControlLoop, PastSteps]:
    """120 control steps, of which the last 100 come after a rewind."""
    loop, past = ControlLoop(make_robot("ant"), policy, small_map, 3), PastSteps()
    while loop.step < 120:
        past.add(loop.advance(EVENTS.get(loop.step, ())))
    return loop, past


def test_the_ranking_is_that_of_a_dissection_over_the_same_steps(
    driven: tuple[ControlLoop, PastSteps],
) -> None:
    loop, past = driven
    attributes, dt = loop.robot.attributes, loop.robot.control_dt
    stretch = past.latest_stretch(120, 1000)
    assert len(stretch) == 100
    found = compute_spectra(stretch, attributes, SpectraChoice(2), PAPER, dt)
    used = stretch[-96:]  # three windows, 16 steps apart
    values = unwrap_angles(np.array([record.attributes for record in used]), attributes)
    episode = MonitoredEpisode(0, np.array([record.activations for record in used]), values)
    matched = match_units([episode], attributes, PAPER)
    assert [ranked.unit for ranked in found.ranking] == matched.ranked_units(2)[:20].tolist()
    assert found.unit == found.ranking[0].unit
    assert found.discrepancy == pytest.approx(matched.discrepancy[2, found.unit])
    assert (found.moment, found.steps) == (120, 96)
    assert found.attribute_power is not None
    assert found.unit_power is not None
    assert found.frequencies is not None
    assert found.attribute_power.shape == found.unit_power.shape == (3, 33)
    assert found.frequencies[-1] == pytest.approx(0.5 / dt)
    distance = np.linalg.norm(found.attribute_power - found.unit_power)
    assert distance == pytest.approx(found.discrepancy)
    chosen = compute_spectra(stretch, attributes, SpectraChoice(2, unit=7), PAPER, dt)
    assert chosen.unit == 7
    assert chosen.discrepancy == pytest.approx(matched.discrepancy[2, 7])


def test_too_few_steps_since_a_jump_are_said(driven: tuple[ControlLoop, PastSteps]) -> None:
    loop, past = driven
    found = compute_spectra(
        past.latest_stretch(60, 1000), loop.robot.attributes, SpectraChoice(0), PAPER, 0.05
    )
    assert found.message == "a window needs 64 control steps without a jump, here are 40"


def test_they_come_while_they_are_asked_for(driven: tuple[ControlLoop, PastSteps]) -> None:
    loop, past = driven
    spectra = LiveSpectra(loop.robot.attributes, loop.robot.control_dt)
    assert spectra.update(past, 120) is None

    def wait(choice: SpectraChoice, moment: int) -> SpectraSnapshot:
        spectra.choose(choice)
        deadline = time.monotonic() + 60.0
        while time.monotonic() < deadline:
            found = spectra.update(past, moment)
            if found is not None and found.choice == choice and abs(found.moment - moment) < 16:
                return found
            time.sleep(0.005)
        raise AssertionError("no spectrograms in 60 s")

    assert wait(SpectraChoice(0), 120).moment == 120
    assert wait(SpectraChoice(1, unit=3), 120).unit == 3
    assert wait(SpectraChoice(1, unit=3), 100).moment == 100
    spectra.choose(None)
    assert spectra.update(past, 120) is None
