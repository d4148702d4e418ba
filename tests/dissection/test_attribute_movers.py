from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from pdtui.core.attributes import Attribute
from pdtui.core.reserved_keys import RESERVED_KEYS
from pdtui.dissection.attribute_movers import find_attribute_movers, movable_attribute_columns
from pdtui.dissection.dissection_config import QUICK_DISSECTION
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.unit_selection import select_units_to_refine
from pdtui.spectra.episode_monitor import MonitoredEpisode, monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset
from pdtui.stimulation.key_allocator import KeyAllocator
from tests.wired_policy import WIRED_MOTOR, WIRED_UNIT


def test_the_unit_that_is_wired_to_a_motor_moves_the_body_both_ways(wired_file: Path) -> None:
    with RolloutPool("ant", wired_file, 1) as crew:
        prober = EffectProbe(crew)
        episodes = monitor_episodes(crew.robot, crew.policy, range(1000, 1002), 80)
        spread = np.concatenate([episode.attributes for episode in episodes]).std(axis=0)
        starts = collect_start_states(crew.robot, crew.policy, 1100, 14, at=10)
        screen = prober.measure_units(range(crew.policy.units), (-4.0, 4.0), starts[:2], steps=16)
        everything = range(len(crew.robot.attributes))
        chosen = select_units_to_refine(
            screen, match_units(episodes, crew.robot.attributes, find_matching_preset("paper")), everything, 1
        )
        refined = prober.measure_units(chosen, (-4.0, 0.0, 4.0), starts[2:4], steps=16)
        plan = replace(QUICK_DISSECTION, mover_steps=18, mover_singles=3, mover_pairs=3)
        columns = movable_attribute_columns(crew.robot.attributes, episodes)
        found = find_attribute_movers(prober, columns, spread, screen, refined, starts[4:6], starts[6:], plan)
        assert found
        assert WIRED_MOTOR >= 0
        for one in found:
            assert crew.robot.attributes[one.column].unit != "N m"
            assert crew.policy.layers[0] + WIRED_UNIT in one.stimulation.units
            assert one.sign * one.measured.low > 0
            assert one.sign * one.measured.high > 0
            again = prober.measure_plans([one.stimulation], starts[6:], steps=18, measure_from=6)
            assert np.isclose(one.measured.effect, again.effects[0, :, one.column].mean())


def test_only_what_the_body_does_and_can_do_otherwise_is_steered() -> None:
    time = np.arange(200) / 20
    gait, noise = np.sin(7 * time), np.random.default_rng(1).normal(size=time.size)
    series = {
        "vx": 2.0 + 0.3 * gait,
        "knee": noise,
        "height": np.full(time.size, 0.7),
        "x": 2.0 * time + 0.1 * gait,
        "speed": np.abs(2.0 + 0.3 * gait),
        "reward": 1.0 + noise,
        "yaw": 3.0 * time,
        "pitch": np.exp(-time) + 0.001 * noise,
    }
    units = {"knee": "N m", "yaw": "rad"}
    attributes = [Attribute(name, units.get(name, "m/s"), wraps=name == "yaw") for name in series]
    episode = MonitoredEpisode(0, np.zeros((200, 1), np.float32), np.stack(list(series.values()), axis=1), "")
    assert [attributes[column].name for column in movable_attribute_columns(attributes, [episode])] == [
        "vx",
        "yaw",
        "pitch",
    ]


def test_keys_come_in_pairs_once_each_and_never_reserved_ones() -> None:
    keys = KeyAllocator({"x", "h"})
    assert keys.take_key_pair("thigh angle") == ("T", "t")
    assert keys.take_key_pair("height") == ("E", "e")
    taken = [keys.take_key_pair("leg angle") for _ in range(40)]
    given = [key for pair in taken if pair is not None for key in pair]
    assert given[:4] == ["L", "l", "A", "a"]
    assert len(given) == len(set(given))
    assert not {key.lower() for key in given} & {*RESERVED_KEYS, "x", "h", "t", "e"}
    assert taken[-1] is None
