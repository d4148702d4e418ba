"""What the shipped maps of imprints and directions do, on one seed each; the guide has more figures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import pdtui
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.key_release.key_release_evaluation import evaluate_key_releases
from pdtui.robots.task import find_longest_run
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map

SEED = 1800


@pytest.mark.parametrize(
    ("robot", "key", "attribute", "low", "high"),
    [
        ("ant", "w", "vy", 4.0, 6.0),
        ("ant", "s", "vy", -6.0, -4.0),
        ("ant", "a", "yaw rate", 0.6, 1.0),
        ("ant", "d", "yaw rate", -1.0, -0.6),
        ("anymal-forward", "a", "yaw rate", 0.6, 0.9),
        ("anymal-forward", "d", "yaw rate", -0.9, -0.6),
        ("anymal-forward", "j", "sideways", 0.25, 0.5),
        ("a1", "a", "yaw rate", 0.4, 0.9),
    ],
)
def test_a_key_steers_until_it_is_let_go(
    robot: str, key: str, attribute: str, low: float, high: float
) -> None:
    drive = pdtui.drive(robot, f"{robot}-imprints", keys={100: key}, steps=500, seed=SEED)
    assert not drive.endings
    assert low <= drive[attribute][300:].mean() <= high
    assert not low <= drive[attribute][40:100].mean() <= high


@pytest.mark.parametrize(
    ("key", "attribute", "low", "high"),
    [
        ("a", "yaw rate", 0.6, 0.7),
        ("d", "yaw rate", -0.7, -0.6),
        ("j", "sideways", 0.28, 0.36),
        ("l", "sideways", -0.36, -0.28),
    ],
)
def test_one_direction_of_the_first_layer_turns_anymal_and_moves_it_aside(
    key: str, attribute: str, low: float, high: float
) -> None:
    drive = pdtui.drive(
        "anymal-forward", "anymal-forward-directions", keys={100: key, 600: "space"}, steps=800, seed=SEED
    )
    assert not drive.endings
    assert low <= drive[attribute][350:600].mean() <= high
    assert abs(drive[attribute][700:].mean()) < 0.1
    assert drive["speed"][700:].mean() > 0.9


def test_the_a1_stands_and_runs_on() -> None:
    drive = pdtui.drive(
        "a1", "a1-imprints", keys={110: "x", 450: "space"}, steps=700, seed=SEED, start="rough"
    )
    assert not drive.endings
    feet = [one.name for one in drive.info.attributes if one.name.endswith(" contact")]
    assert len(feet) == 4
    assert drive["speed"][350:450].mean() < 0.05
    assert all(drive[name][350:450].min() == 1.0 for name in feet)
    assert drive["speed"][600:].mean() > 2.0


@pytest.mark.parametrize("key", ["a", "d"])
def test_the_ant_runs_on_when_a_spin_is_let_go(key: str) -> None:
    drive = pdtui.drive("ant", "ant-imprints", keys={100: key, 600: "space"}, steps=900, seed=1803)
    assert not drive.endings
    assert abs(drive["yaw"][600] - drive["yaw"][100]) > 0.5  # another heading
    assert drive["vx"][-60:].mean() > 3.5


def test_the_ant_faces_where_the_arrow_keys_point() -> None:
    left = dict.fromkeys(range(61, 69), "left")
    drive = pdtui.drive("ant", "ant-imprints", keys={60: "h", **left}, steps=600, seed=SEED)
    assert not drive.endings
    target = drive["yaw"][59] + 8 * 0.2
    error = (drive["yaw"][400:] - target + np.pi) % (2 * np.pi) - np.pi
    assert abs(error.mean()) < 0.15


def test_the_walker_stands_and_runs_on() -> None:
    drive = pdtui.drive("walker", "walker-imprints", keys={250: "x"}, steps=1100, seed=SEED)
    assert not drive.endings
    assert drive["speed"][150:250].mean() > 2.5
    assert drive["speed"][550:750].mean() < 0.5
    assert drive["speed"][-50:].mean() > 2.0


@pytest.mark.parametrize(("there", "back", "sign"), [("left", "right", 1), ("right", "left", -1)])
def test_cassie_turns_by_ninety_degrees_and_back(there: str, back: str, sign: int) -> None:
    keys = {100: "h"} | {101 + n: there for n in range(6)} | {500 + n: back for n in range(6)}
    drive = pdtui.drive("cassie", keys=keys, steps=900, seed=SEED)
    assert not drive.endings
    before = drive["yaw"][99]
    turned = [
        (drive["yaw"][part] - before + np.pi) % (2 * np.pi) - np.pi
        for part in (slice(400, 500), slice(800, 900))
    ]
    assert np.mean(turned[0]) == pytest.approx(sign * np.pi / 2, abs=0.3)
    assert np.mean(turned[1]) == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize(("key", "sign"), [("j", 1), ("l", -1)])
def test_cassie_steps_aside(key: str, sign: int) -> None:
    drive = pdtui.drive("cassie", keys={100: key}, steps=300, seed=SEED)
    assert not drive.endings
    assert 0.25 < sign * drive["vy"][150:].mean() < 0.8
    assert drive["vx"][150:].mean() < 0.6


def test_cassie_ducks_and_walks_on() -> None:
    drive = pdtui.drive("cassie", keys={100: "c"}, steps=400, seed=SEED)
    assert not drive.endings
    assert drive["height"][60:100].mean() - drive["height"][130:175].mean() > 0.07
    assert drive["forward"][-100:].mean() > 0.8


def test_cassie_stays_in_place() -> None:
    drive = pdtui.drive("cassie", keys={100: "z"}, steps=700, seed=SEED)
    assert not drive.endings
    places = np.cumsum(np.stack([drive["vx"], drive["vy"]]) * 0.02, axis=1)
    assert np.hypot(*(places[:, -1] - places[:, -251])) < 0.25


def test_cassie_walks_on_tiptoe_and_on_its_soles_again() -> None:
    drive = pdtui.drive("cassie", keys={100: "t", 350: "space"}, steps=550, seed=SEED)
    assert not drive.endings
    before = drive["height"][50:100].mean()
    assert drive["height"][250:350].mean() > 1.1 * before
    assert drive["forward"][250:350].mean() > 0.8
    assert drive["height"][-50:].mean() < 1.02 * before


def test_cassie_walks_on_crouched() -> None:
    drive = pdtui.drive("cassie", keys={100: "k"}, steps=350, seed=SEED)
    assert not drive.endings
    assert drive["height"][250:].mean() < 0.62 * drive["height"][50:100].mean()
    assert drive["forward"][250:].mean() > 0.5


def test_cassie_jumps_and_walks_on() -> None:
    drive = pdtui.drive("cassie", keys={120: "i"}, steps=420, seed=SEED)
    assert not drive.endings
    feet = np.minimum(drive["left foot height"], drive["right foot height"])
    airborne = (drive["left contact"] == 0.0) & (drive["right contact"] == 0.0)
    assert feet[40:120].max() < 0.1  # its start drops it
    assert feet[120:].max() > 0.2
    assert find_longest_run(airborne[40:120]) * 0.02 < 0.1
    assert find_longest_run(airborne[120:]) * 0.02 >= 0.3
    assert np.abs(drive["pelvis pitch"][120:]).max() < math.radians(45)
    assert drive["forward"][-100:].mean() > 0.9


def test_cassie_flips_backward_and_walks_on() -> None:
    drive = pdtui.drive("cassie", keys={120: "b"}, steps=420, seed=SEED)
    assert not drive.endings
    pitch, feet = np.unwrap(drive["pelvis pitch"]), (drive["left foot height"], drive["right foot height"])
    assert pitch[120] - pitch.min() > math.radians(330)
    assert np.minimum(*feet).max() > 0.8  # over its head
    assert drive["forward"][-100:].mean() > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("first", [1500, 100])
def test_whole_turns_make_no_ant_fall_that_observes_the_canonical_quaternion(first: int) -> None:
    """Let go of its spins at once, after 25 s; the shipped maps fade instead, since the usual Ant falls."""
    shipped = load_map(find_map("ant-imprints"))
    spins = {name: replace(shipped.behaviors[name], fade=0.0) for name in ("spin left", "spin right")}
    falls = {}
    for canonical in (False, True):
        changed = replace(shipped, behaviors=spins, robot_options={"canonical_quaternion": canonical})
        found = evaluate_key_releases(DriveConfig("ant", changed, 0), range(first, first + 20)).behaviors
        print(f"canonical: {canonical}", *found, sep="\n")
        falls[canonical] = sum(one.failed for one in found)
    assert falls[False] >= 5
    assert falls[True] <= falls[False] / 2
