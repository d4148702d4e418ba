from __future__ import annotations

from pathlib import Path

import numpy as np

from pdtui.dissection.confirm import select_units
from pdtui.dissection.keys import Keys
from pdtui.dissection.matching import match
from pdtui.dissection.monitor import collect_starts, monitor
from pdtui.dissection.probe import Prober
from pdtui.dissection.settings import find_preset
from pdtui.dissection.steer import movable, steer
from pdtui.dissection.workers import Crew
from pdtui.robots.types import Attribute
from pdtui.stimulation.maps import RESERVED_KEYS
from tests.dissection.conftest import WIRED_MOTOR, WIRED_UNIT


def test_the_unit_that_is_wired_to_a_motor_moves_the_body_both_ways(wired_file: Path) -> None:
    with Crew("ant", wired_file, 1) as crew:
        prober = Prober(crew)
        episodes = monitor(crew.robot, crew.policy, range(1000, 1002), 80)
        spread = np.concatenate([episode.attributes for episode in episodes]).std(axis=0)
        starts = collect_starts(crew.robot, crew.policy, 1100, 8, at=10, survive=20)
        screen = prober.sweep(range(crew.policy.units), (-4.0, 4.0), starts[:2], steps=16)
        columns = range(len(crew.robot.attributes))
        chosen = select_units(
            screen, match(episodes, crew.robot.attributes, find_preset("paper")), columns, 1
        )
        refined = prober.sweep(chosen, (-4.0, 0.0, 4.0), starts[2:4], steps=16)
        found = steer(prober, movable(crew.robot.attributes, spread), spread, screen, refined, starts[4:], 16)
        assert found
        assert WIRED_MOTOR >= 0
        for one in found:
            assert crew.robot.attributes[one.column].unit != "N m"
            assert crew.policy.layers[0] + WIRED_UNIT in one.stimulation.units
            assert one.sign * one.measured.low > 0
            assert one.sign * one.measured.high > 0
            again = prober.probe([one.stimulation], starts[6:], steps=16)
            assert np.isclose(one.measured.effect, again.effects[0, :, one.column].mean())


def test_what_does_not_vary_and_torques_are_not_steered() -> None:
    attributes = [Attribute("vx", "m/s"), Attribute("knee", "N m"), Attribute("height", "m")]
    assert movable(attributes, np.array([1.0, 1.0, 0.0])) == [0]


def test_keys_are_handed_out_once_and_never_reserved_ones() -> None:
    keys = Keys({"x"})
    taken = [keys.take("pitch") for _ in range(40)]
    given = [key for key in taken if key is not None]
    assert given[0] == "i"
    assert len(given) == len(set(given))
    assert not {*given} & {*RESERVED_KEYS, "x"}
    assert taken[-1] is None
