"""Gates, and behaviors that wait for a moment of the gait."""

from __future__ import annotations

import numpy as np
import pytest

from pdtui.core.attributes import Attribute
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.stimulation.behavior_latch import BehaviorLatch
from pdtui.stimulation.map_reader import parse_map
from tests.stimulation.interventions.walker_map import MAP_HEAD

ATTRIBUTES = (Attribute("foot clearance", "m"), Attribute("speed", "m/s"))
PERIOD = 20  # control steps of a made-up gait
DT = 0.1


def _latch(behavior: str) -> BehaviorLatch:
    text = f"""{MAP_HEAD}[[behaviors]]
name = "it"
key = "a"
{behavior}
"""
    return BehaviorLatch(parse_map(text, "m"), (4,), ATTRIBUTES, DT)


def _gait(step: int) -> np.ndarray:
    """Return attributes whose foot leaves the ground at steps 5, 25, 45 and so on."""
    return np.array([0.1 if (step - 5) % PERIOD < 8 else -0.1, 0.05 * step])


ONSET = 'magnitudes = {"0:1" = 2.0}\nonset = {signal = "foot clearance", level = 0.0, delay = 0.4}\n'


def _drive(latch: BehaviorLatch, steps: range, press: int) -> list[bool]:
    """Return whether a unit is stimulated in each step."""
    on = []
    for step in steps:
        if step == press:
            latch.latch_behavior("it", _gait(step))
        on.append(bool(latch.stimulate(_gait(step))))
        latch.end_step()
    return on


@pytest.mark.parametrize(("press", "begins"), [(27, 29), (29, 29), (30, 49), (45, 49)])
def test_an_armed_behavior_begins_at_its_moment(press: int, begins: int) -> None:
    on = _drive(_latch(ONSET), range(80), press)
    assert on.index(True) == begins
    assert all(on[begins:])


def test_the_screen_is_told_how_long_it_still_waits() -> None:
    latch = _latch(ONSET)
    waits = []
    for step in range(50):
        if step == 41:
            latch.latch_behavior("it", _gait(step))
        latch.stimulate(_gait(step))
        waits += [one.waiting for one in latch.active]
        latch.end_step()
    assert waits == [8, 7, 6, 5, 4, 3, 2, 1, None]


def test_it_says_that_it_cannot_know_before_it_has_seen_the_gait() -> None:
    latch = _latch(ONSET)
    latch.latch_behavior("it", _gait(0))
    latch.stimulate(_gait(0))
    assert [one.waiting for one in latch.active] == [-1]


def test_the_period_counts_from_the_onset() -> None:
    on = _drive(_latch(ONSET + "period = 0.5\n"), range(80), 30)
    assert np.flatnonzero(on).tolist() == [49, 50, 51, 52, 53]


def test_a_new_episode_forgets_the_gait() -> None:
    latch = _latch(ONSET)
    _drive(latch, range(30), 99)
    latch.start_episode()
    latch.latch_behavior("it", _gait(30))
    latch.stimulate(_gait(30))
    assert [one.waiting for one in latch.active] == [-1]


def test_a_copy_of_the_state_goes_on_in_the_same_way() -> None:
    latch = _latch(ONSET)
    _drive(latch, range(30), 99)
    latch.latch_behavior("it", _gait(30))
    state = latch.copy_state()
    first = _drive(latch, range(30, 60), 99)
    latch.restore_state(state)
    assert _drive(latch, range(30, 60), 99) == first
    assert first.index(True) == 19


def _added(latch: BehaviorLatch, steps: int) -> list[float]:
    """Return what is added to unit 0:1 in each step."""
    latch.latch_behavior("it", _gait(0))
    added = []
    for step in range(steps):
        edits = latch.stimulate(_gait(step)).edits
        added.append(float(edits[0].change(np.zeros(1, np.float32))[0]) if edits else 0.0)
        latch.end_step()
    return added


ADD = '[[behaviors.interventions]]\nkind = "add"\nvalues = {"0:1" = 1.0}\n'


def test_a_time_gate_makes_pulses() -> None:
    gate = "time_gate = {times = [0.0, 0.3], factors = [1.0, 0.0], repeat = 0.5}"
    assert _added(_latch(ADD + gate), 11) == [1, 1, 1, 0, 0, 1, 1, 1, 0, 0, 1]


def test_a_time_gate_ramps() -> None:
    gate = "time_gate = {times = [0.0, 0.4], factors = [0.0, 1.0], interpolate = true}"
    np.testing.assert_allclose(_added(_latch(ADD + gate), 7), [0, 0.25, 0.5, 0.75, 1, 1, 1], atol=1e-5)


def test_a_range_gate_opens_within_its_range() -> None:
    gate = 'range_gate = {attribute = "speed", low = 0.1, high = 0.2}'
    assert _added(_latch(ADD + gate), 7) == [0, 0, 1, 1, 1, 0, 0]


def test_a_phase_gate_follows_the_gait() -> None:
    gate = 'phase_gate = {signal = "foot clearance", factors = [1.0, 0.0, -1.0, 0.0]}'
    added = _added(_latch(ADD + gate), 66)
    assert not any(added[:25])  # the period is known from the second moment on
    expected = [np.interp(phase, [0, 0.25, 0.5, 0.75, 1], [1, 0, -1, 0, 1]) for phase in np.arange(20) / 20]
    np.testing.assert_allclose(added[25:65], expected + expected, atol=1e-6)


def test_a_foot_that_bounces_counts_once() -> None:
    latch = _latch(ONSET.replace("delay = 0.4", "delay = 0.4, minimum_spacing = 1.0"))
    heights = {5: 0.1, 6: -0.1, 7: 0.1}
    latch.latch_behavior("it", _gait(0))
    begins = None
    for step in range(20):
        if latch.stimulate(np.array([heights.get(step, -0.1 if step < 5 else 0.1), 0.0])) and begins is None:
            begins = step
        latch.end_step()
    assert begins == 9


FADING = "fade = 0.4\n" + ADD


def test_a_behavior_fades_when_it_is_let_go() -> None:
    latch = _latch(FADING)
    added = []
    latch.latch_behavior("it", _gait(0))
    for step in range(9):
        if step == 3:
            latch.clear()
        edits = latch.stimulate(_gait(step)).edits
        added.append(float(edits[0].change(np.zeros(1, np.float32))[0]) if edits else 0.0)
        assert [one.name for one in latch.active] == (["it"] if step < 3 else [])
        latch.end_step()
    np.testing.assert_allclose(added, [1, 1, 1, 0.8, 0.6, 0.4, 0.2, 0, 0], atol=1e-6)


def test_a_period_that_ends_fades_too() -> None:
    added = _added(_latch("period = 0.3\n" + FADING), 9)
    np.testing.assert_allclose(added, [1, 1, 1, 0.8, 0.6, 0.4, 0.2, 0, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("period", "short"),
    [(2 * np.pi, 6.0 - 2 * np.pi), (4 * np.pi, 6.0), (0.0, 6.0)],
    ids=["angle", "quaternion", "length"],
)
def test_an_imprint_fades_by_the_shorter_way(period: float, short: float) -> None:
    sizes: list[float] = []

    def note(observation: np.ndarray, size: float) -> np.ndarray:
        sizes.append(size)
        return observation

    text = (
        MAP_HEAD
        + """
[[behaviors]]
name = "it"
key = "a"
fade = 0.2
[[behaviors.interventions]]
kind = "imprint"
units = ["0:1"]
values = {turn = 6.0}
"""
    )
    edit = ObservationEdit("turn", "rad", "it is turned", note, period)
    latch = BehaviorLatch(parse_map(text, "m"), (4,), ATTRIBUTES, DT, (edit,))
    latch.latch_behavior("it", _gait(0))
    for step in range(3):
        if step == 1:
            latch.clear()
        for one in latch.stimulate(_gait(step)).edits:
            one.prepare(np.zeros(2), lambda _observation, _last: np.zeros(4, np.float32))
        latch.end_step()
    np.testing.assert_allclose(sizes, [6.0, short * 2 / 3, short / 3])


def test_an_imprint_begins_where_one_that_fades_is() -> None:
    shown: list[float] = []
    turn = ObservationEdit("turn", "rad", "it is turned", lambda observation, size: observation + size)
    imprint = """
[[behaviors.interventions]]
kind = "imprint"
units = ["0:1"]
values = {turn = SIZE}
"""
    first = '[[behaviors]]\nname = "it"\nkey = "a"\nfade = 0.3\n' + imprint.replace("SIZE", "4.0")
    second = '[[behaviors]]\nname = "other"\nkey = "b"\nfade = 0.1\n' + imprint.replace("SIZE", "-1.0")
    latch = BehaviorLatch(parse_map(MAP_HEAD + first + second, "m"), (4,), ATTRIBUTES, DT, (turn,))

    def note(observation: np.ndarray, _last: int) -> np.ndarray:
        shown.append(float(observation[0]))
        return np.zeros(4, np.float32)

    latch.latch_behavior("it", _gait(0))
    for step in range(7):
        if step == 1:
            latch.latch_behavior("other", _gait(0))
        if step == 5:
            latch.clear()
        edits = latch.stimulate(_gait(step)).edits
        if edits:  # the last decides
            edits[-1].prepare(np.zeros(2), note)
        latch.end_step()
    np.testing.assert_allclose(shown, [4.0, 3.0 - 1.0, 2.0 - 1.0, 1.0 - 1.0, -1.0, -0.5])
