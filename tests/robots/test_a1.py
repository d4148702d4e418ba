"""The A1: the authors' policy runs, ground and trees are where it says, and all of it repeats bit for bit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.attributes import wrap_angle
from pdtui.core.errors import RobotError
from pdtui.robots import make_robot
from pdtui.robots.geometry import compute_link_poses

pytest.importorskip("pybullet", reason="PyBullet is not installed (it has no wheels for this Python)")

from pdtui.robots.a1 import A1

REFERENCE = Path(__file__).parents[3] / "shared" / "reference"
TERRAINS = ("plane", "rough", "forest")


def _actions(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.6, 0.6, (count, 6)).astype(np.float32)


def _digests(robot: A1, actions: np.ndarray) -> list[tuple[float, int]]:
    return [(robot.step(action)[1], robot.digest()) for action in actions]


@pytest.fixture(scope="module")
def a1() -> A1:
    return A1()


def _value(robot: A1, name: str) -> float:
    return float(robot.read_attributes()[robot.attribute_index(name)])


@pytest.mark.skipif(not REFERENCE.exists(), reason="the authors' weights (../shared/reference) are not here")
def test_the_authors_policy_runs_as_measured(a1: A1) -> None:
    weights = np.load(REFERENCE / "quadrupedal.npz")
    normalizer = np.load(REFERENCE / "quadrupedal_obs_normalizer.npz")
    names = ("base.seq_fcs.0", "base.seq_fcs.2", "seq_append_fcs.0", "seq_append_fcs.2", "seq_append_fcs.4")
    layers = [(weights[f"{name}.weight"], weights[f"{name}.bias"]) for name in names]
    for seed in range(4):
        observation, _ = a1.reset(seed=seed)
        speeds = []
        for _ in range(500):
            x = (observation - normalizer["mean"]) / (np.sqrt(normalizer["var"]) + 1e-4)
            x = np.clip(x, -10, 10)
            for weight, bias in layers[:-1]:
                x = np.tanh(weight @ x + bias)
            mean = layers[-1][0] @ x + layers[-1][1]
            observation, _, fell, _, _ = a1.step(np.tanh(np.tanh(mean)).astype(np.float32))
            assert not fell
            speeds.append(_value(a1, "vx"))
        assert 4.9 < np.mean(speeds[50:]) < 5.3


@pytest.mark.parametrize("start", TERRAINS)
def test_episodes_of_one_seed_are_the_same_whatever_came_before(a1: A1, start: str) -> None:
    a1.reset(seed=7, options={"start": start})
    first = _digests(a1, _actions(40))
    a1.reset(seed=1, options={"start": "rough"})
    _digests(a1, _actions(25, 1))
    a1.reset(seed=7, options={"start": start})
    assert _digests(a1, _actions(40)) == first
    a1.reset(seed=8, options={"start": start})
    assert _digests(a1, _actions(40)) != first


@pytest.mark.parametrize("start", TERRAINS)
def test_a_snapshot_restores_bit_for_bit_into_another_robot(a1: A1, start: str) -> None:
    other = A1()
    a1.reset(seed=2, options={"start": start})
    _digests(a1, _actions(30))
    snapshot, seen, digest = a1.snapshot(), a1.read_attributes(), a1.digest()
    first = _digests(a1, _actions(40, 1))
    for robot in (a1, other):
        robot.restore(snapshot)
        assert robot.digest() == digest
        np.testing.assert_array_equal(robot.read_attributes(), seen)
        np.testing.assert_array_equal(robot.scenery.cylinders, a1.scenery.cylinders)
        assert _digests(robot, _actions(40, 1)) == first
    other.close()


def test_another_process_gets_the_same_bits(a1: A1) -> None:
    script = (
        "import numpy as np; from pdtui.robots.a1 import A1; robot = A1('forest'); robot.reset(seed=3);"
        "actions = np.random.default_rng(0).uniform(-0.6, 0.6, (60, 6)).astype(np.float32);"
        "[robot.step(action) for action in actions]; print(robot.digest())"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    a1.reset(seed=3, options={"start": "forest"})
    _digests(a1, _actions(60))
    # Also: PyBullet's own greetings stay off the screen.
    assert (ran.stdout, ran.stderr) == (f"{a1.digest()}\n", "")


def test_looking_changes_nothing(a1: A1) -> None:
    a1.reset(seed=4, options={"start": "rough"})
    first = _digests(a1, _actions(30))
    a1.reset(seed=4, options={"start": "rough"})
    second = []
    for action in _actions(30):
        second += _digests(a1, action[None])
        a1.read_poses(), a1.read_attributes(), a1.snapshot()
    assert second == first


def test_it_stands_on_four_feet(a1: A1) -> None:
    a1.reset(seed=0)
    for _ in range(100):
        a1.step(np.zeros(6, np.float32))
    assert [
        _value(a1, f"{end} {side} contact") for end in ("front", "rear") for side in ("right", "left")
    ] == [1] * 4
    assert 0.24 < _value(a1, "height") < 0.28
    assert abs(_value(a1, "speed")) < 0.02
    placed = compute_link_poses(a1.links, a1.read_poses())
    feet = [index for index, link in enumerate(a1.links) if link.name.endswith("toe")]
    assert len(feet) == 4
    radii = [a1.links[index].size[0] for index in feet]
    np.testing.assert_allclose(placed[feet, 2] - radii, 0.0, atol=0.004)
    assert placed[0, 2] == pytest.approx(_value(a1, "height"), abs=0.002)


def test_the_newest_of_three_steps_is_seen_first(a1: A1) -> None:
    a1.reset(seed=0)
    first = [a1.step(action)[0] for action in _actions(4)]
    for low, width in ((0, 3), (9, 4), (21, 12), (57, 12)):
        newest, second = slice(low, low + width), slice(low + width, low + 2 * width)
        np.testing.assert_array_equal(first[3][second], first[2][newest])
        assert (first[3][newest] != first[3][second]).any()
    np.testing.assert_array_equal(a1.observe(), first[3])
    assert first[3].shape == a1.observation_space.shape


def test_diagonal_legs_share_their_targets(a1: A1) -> None:
    a1.reset(seed=0)
    right = a1.step(np.array([0, 0.5, -0.5, 0, 0, 0], np.float32))[0][21:33].reshape(4, 3)
    np.testing.assert_allclose(right[[0, 3]], [[0, 1.15, -2.05]] * 2)
    np.testing.assert_allclose(right[[1, 2]], [[0, 0.9, -1.8]] * 2)


def test_ground_is_where_it_says(a1: A1) -> None:
    a1.reset(seed=5, options={"start": "rough"})
    assert a1.ground is not None
    rng = np.random.default_rng(0)
    # At the grid's own points the triangles between them do not matter.
    columns, rows = rng.integers(1, 255, 200), rng.integers(1, 79, 200)
    x, y = a1.ground.corner[0] + 0.25 * columns, a1.ground.corner[1] + 0.25 * rows
    rays = [([u, v, 1.0], [u, v, -1.0]) for u, v in zip(x.tolist(), y.tolist(), strict=True)]
    hits = a1.bullet.rayTestBatch([a for a, _ in rays], [b for _, b in rays])
    measured = [hit[3][2] for hit in hits if hit[0] != a1.robot_id]
    expected = [
        a1.ground.height(u, v)
        for (u, v), hit in zip(zip(x, y, strict=True), hits, strict=True)
        if hit[0] != a1.robot_id
    ]
    np.testing.assert_allclose(measured, expected, atol=1e-3)
    assert np.std(expected) > 0.01


def test_a_forest_is_rough_ground_with_trees_that_it_does_not_feel() -> None:
    rough, forest = A1("rough"), A1("forest")
    rough.reset(seed=11)
    forest.reset(seed=11)
    assert len(rough.scenery.cylinders) == 0
    trees = forest.scenery.cylinders
    assert len(trees) > 100
    assert trees[:, 0].min() > 2
    for action in _actions(20):
        np.testing.assert_array_equal(rough.step(action)[0], forest.step(action)[0])
    apart = np.hypot(*(trees[1:, None, :2] - trees[None, :, :2]).T)
    radii = trees[:, 2]
    gaps = apart - radii[:, None] - radii[None, 1:]
    assert gaps[apart > 0].min() > 0.89
    forest.reset(seed=12)
    assert not np.array_equal(trees, forest.scenery.cylinders)


def test_running_into_a_tree_costs_one(a1: A1) -> None:
    a1.reset(seed=0, options={"start": "forest"})
    x, y, radius = a1.scenery.cylinders[0]
    assert a1.step(np.zeros(6, np.float32))[4]["cost"] == 0
    a1.bullet.resetBasePositionAndOrientation(a1.robot_id, [x - radius - 0.2, y, 0.33], [0, 0, 0, 1])
    a1.step(np.zeros(6, np.float32))  # now it knows where it is
    costs = []
    for _ in range(10):
        a1.bullet.resetBaseVelocity(a1.robot_id, [1.5, 0, 0], [0, 0, 0])
        costs.append(a1.step(np.zeros(6, np.float32))[4]["cost"])
    assert sum(costs) == 1
    assert _value(a1, "distance") < x


def test_it_falls(a1: A1) -> None:
    a1.reset(seed=0)
    a1.bullet.resetBasePositionAndOrientation(a1.robot_id, [0, 0, 0.3], [np.sin(0.6), 0, 0, np.cos(0.6)])
    _, reward, fell, _, info = a1.step(np.zeros(6, np.float32))
    assert fell
    assert info["reason"].startswith("fell: leans by 6")
    assert reward < -5


def test_turning_left_is_positive(a1: A1) -> None:
    a1.reset(seed=0)
    a1.bullet.resetBaseVelocity(a1.robot_id, [0, 0, 0], [0, 0, 2.0])
    before = _value(a1, "yaw")
    assert _value(a1, "yaw rate") == pytest.approx(2.0, abs=0.1)
    a1.step(np.zeros(6, np.float32))
    assert wrap_angle(_value(a1, "yaw") - before) > 0


def test_what_it_does_not_have_is_refused(a1: A1) -> None:
    with pytest.raises(RobotError, match="no start 'moon'; available: plane, rough, forest"):
        a1.reset(options={"start": "moon"})
    with pytest.raises(RobotError, match="no terrain 'moon'; available: plane, rough, forest"):
        A1("moon")  # type: ignore[arg-type]
    a1.reset(seed=0)
    ant = make_robot("ant")
    ant.reset(seed=0)
    with pytest.raises(RobotError, match="expected a snapshot of a1, got one of ant"):
        a1.restore(ant.snapshot())


def test_without_pybullet_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet_utils.bullet_client", None)
    with pytest.raises(
        RobotError, match=r"needs PyBullet.*wheels for Python 3\.11 and older: install pdtui there"
    ):
        make_robot("a1")
