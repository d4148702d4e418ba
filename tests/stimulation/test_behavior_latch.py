"""Latched behaviors: who ends whom, periods, targets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdtui.core.attributes import Attribute
from pdtui.core.errors import KeystrokeError, RobotError
from pdtui.core.units import Stimulation
from pdtui.stimulation.behavior_latch import BehaviorLatch
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.pid_magnitude import PidMagnitude
from pdtui.stimulation.stimulation_map import PidGains, StimulationMap

ATTRIBUTES = (Attribute("vy", "m/s"), Attribute("yaw", "rad", wraps=True))
AT_REST = np.zeros(2)


@pytest.fixture
def latch(small_map: StimulationMap) -> BehaviorLatch:
    return BehaviorLatch(small_map, (16, 16), ATTRIBUTES, 0.05)


def _names(latch: BehaviorLatch) -> list[str]:
    return [view.name for view in latch.active]


def test_a_latched_behavior_overwrites_until_the_default_key(latch: BehaviorLatch) -> None:
    assert latch.stimulate(AT_REST).units == ()
    latch.latch_behavior("push", AT_REST)
    for _ in range(100):
        stimulation = latch.stimulate(AT_REST)
        assert dict(zip(stimulation.units, stimulation.values, strict=True)) == {3: -2.0, 16 + 7: 2.0}
        latch.end_step()
    latch.clear()
    assert latch.stimulate(AT_REST).units == ()


def test_another_key_ends_a_behavior(latch: BehaviorLatch) -> None:
    latch.latch_behavior("push", AT_REST)
    latch.latch_behavior("hold heading", AT_REST)
    assert _names(latch) == ["hold heading"]


def test_behaviors_that_the_map_allows_run_together(latch: BehaviorLatch) -> None:
    latch.latch_behavior("push", AT_REST)
    latch.latch_behavior("twitch", AT_REST)
    assert _names(latch) == ["push", "twitch"]
    assert set(latch.stimulate(AT_REST).units) == {3, 23, 18}
    latch.latch_behavior("push", AT_REST)
    assert _names(latch) == ["twitch", "push"]


def test_a_period_ends_a_behavior(latch: BehaviorLatch) -> None:
    latch.latch_behavior("twitch", AT_REST)
    seen = []
    while latch.active:
        seen.append(latch.active[0].remaining)
        assert latch.stimulate(AT_REST).units == (18,)
        latch.end_step()
    assert seen == list(range(10, 0, -1))


def test_the_factor_scales_the_outputs(latch: BehaviorLatch) -> None:
    latch.latch_behavior("push", AT_REST)
    latch.set_factor("push", 0.5)
    assert latch.stimulate(AT_REST).values == (-1.0, 1.0)
    with pytest.raises(KeystrokeError, match="'twitch' is not latched"):
        latch.set_factor("twitch", 2.0)


def test_a_target_starts_at_the_present_value_and_moves(latch: BehaviorLatch) -> None:
    latch.latch_behavior("hold heading", np.array([0.0, 0.7]))
    view = latch.active[0]
    assert view.target == 0.7
    latch.controller_of("hold heading").set_target(0.7 + 4.0)
    assert latch.active[0].target == pytest.approx(4.7 - 2 * math.pi)
    latch.latch_behavior("hold heading", AT_REST)
    assert latch.active == ()


def test_errors_name_what_there_is(latch: BehaviorLatch) -> None:
    with pytest.raises(KeystrokeError, match="no behavior 'fly'; available: push, twitch, hold heading"):
        latch.latch_behavior("fly", AT_REST)
    latch.latch_behavior("push", AT_REST)
    with pytest.raises(KeystrokeError, match="'push' holds no target"):
        latch.controller_of("push").set_target(1.0)


def test_an_attribute_that_the_robot_lacks_is_named_at_once(small_map: StimulationMap) -> None:
    with pytest.raises(RobotError, match=r"behavior 'hold heading': no attribute 'yaw'; available: vy"):
        BehaviorLatch(small_map, (16, 16), ATTRIBUTES[:1], 0.05)


def test_a_saved_state_repeats_itself(latch: BehaviorLatch) -> None:
    values = np.column_stack([np.zeros(30), np.linspace(0.0, 0.5, 30)])
    latch.latch_behavior("hold heading", AT_REST)
    latch.controller_of("hold heading").set_target(1.0)
    for row in values[:10]:
        latch.stimulate(row)
    state = latch.copy_state()
    first = [latch.stimulate(row) for row in values[10:]]
    latch.restore_state(state)
    assert [latch.stimulate(row) for row in values[10:]] == first


def test_pid_is_that_of_the_textbook() -> None:
    """Independent computation: P on the error, I summed, D on the measurement, limited."""
    kp, ki, kd, dt, limit = 2.0, 0.5, 0.1, 0.05, 3.0
    controller = PidMagnitude(PidGains("vy", kp, ki, kd, limit, 0.1), wraps=False, dt=dt)
    controller.start(0.0, target=1.0)
    integral, before = 0.0, None
    for value in [0.0, 0.1, 0.3, 0.9, 1.4, 1.2]:
        error = 1.0 - value
        integral = float(np.clip(integral + ki * error * dt, -limit, limit))
        slope = 0.0 if before is None else (value - before) / dt
        expected = float(np.clip(kp * error + integral - kd * slope, -limit, limit))
        assert controller.update(value) == pytest.approx(expected)
        before = value


def test_a_controllers_output_is_added_to_its_base(map_text: str) -> None:
    text = map_text.replace('mode = "pid"', 'mode = "pid"\nbase = { "0:5" = 0.5, "1:1" = -2.0 }')
    latch = BehaviorLatch(parse_map(text, "m"), (16, 16), ATTRIBUTES, 0.05)
    latch.latch_behavior("hold heading", AT_REST)
    assert latch.stimulate(AT_REST) == Stimulation((5, 17), (0.5, -2.0))
    latch.controller_of("hold heading").set_target(0.2)
    stimulation = latch.stimulate(AT_REST)
    controller = latch.active[0].magnitude
    assert controller is not None
    assert controller > 0
    assert stimulation == Stimulation((5, 17), (0.5 + controller, -2.0))


def test_a_heading_crosses_pi_without_a_jump() -> None:
    """The same motion, once across ±π and once far from it, needs the same magnitudes."""
    gains = PidGains("yaw", 2.0, 0.3, 0.4, 3.0, 0.1)
    turned = np.linspace(-0.3, 0.3, 40)

    def run(offset: float) -> list[float]:
        controller = PidMagnitude(gains, wraps=True, dt=0.05)
        wrapped = (turned + offset + math.pi) % (2 * math.pi) - math.pi
        controller.start(float(wrapped[0]))
        controller.set_target(offset + 0.4)
        return [controller.update(float(value)) for value in wrapped]

    np.testing.assert_allclose(run(math.pi), run(0.0), atol=1e-9)
