"""The BipedalWalker: stock motion on flat ground, the same again after every reset, snapshots by actions."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.envs.box2d import bipedal_walker as stock
from gymnasium.utils import seeding

from pdtui.core.errors import RobotError
from pdtui.robots.bipedal_walker import FINISH, BipedalWalker


def _actions(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, 4)).astype(np.float32)


@pytest.fixture
def walker() -> BipedalWalker:
    robot = BipedalWalker()
    robot.reset(seed=5)
    return robot


def _value(robot: BipedalWalker, name: str) -> float:
    return float(robot.read_attributes()[robot.attribute_index(name)])


class _OnOneEdge(stock.BipedalWalker):
    """Stock on even ground: stock's own is made of short edges, and feet catch on the seams between them."""

    def _generate_terrain(self, hardcore: bool) -> None:
        super()._generate_terrain(hardcore)
        for body in self.terrain:
            self.world.DestroyBody(body)
        self.fd_edge.shape.vertices = [(0, stock.TERRAIN_HEIGHT), (100, stock.TERRAIN_HEIGHT)]
        ground = self.world.CreateStaticBody(fixtures=self.fd_edge)
        ground.color1 = ground.color2 = (0, 0, 0)
        self.terrain = [ground]

    def _generate_clouds(self) -> None:
        # Drawn next is the push at the start, here from the seed alone.
        self.np_random = seeding.np_random(3)[0]


def test_with_stock_motors_it_moves_and_pays_as_stock_does() -> None:
    mine, theirs = BipedalWalker(torque=stock.MOTORS_TORQUE), _OnOneEdge()
    mine.reset(seed=3)
    theirs.reset(seed=3)
    for action in 0.3 * _actions(40):
        got, expected = mine.step(action), theirs.step(action)
        np.testing.assert_allclose(got[0], expected[0], atol=1e-6)
        assert got[1] == pytest.approx(expected[1], abs=1e-6)
        assert got[2] == expected[2]
        if got[2]:
            break


def test_episodes_of_one_seed_are_the_same_whatever_came_before(walker: BipedalWalker) -> None:
    def episode() -> list[int]:
        walker.reset(seed=7)
        return [(walker.step(action), walker.digest())[1] for action in 0.5 * _actions(60)]

    first = episode()
    walker.reset(seed=1)
    for action in _actions(30):
        walker.step(action)
    assert episode() == first


@pytest.mark.parametrize("start", ["", "split"])
def test_a_snapshot_restores_bit_for_bit(start: str) -> None:
    robot, other = BipedalWalker(), BipedalWalker()
    robot.reset(seed=2, options={"start": start})
    for action in 0.2 * _actions(10):
        robot.step(action)
    snapshot, rest = robot.snapshot(), 0.2 * _actions(10, 1)
    first = [(robot.step(action)[1], robot.digest()) for action in rest]
    other.reset(seed=9)
    other.restore(snapshot)
    assert [(other.step(action)[1], other.digest()) for action in rest] == first


def test_a_snapshot_stays_when_the_episode_goes_on(walker: BipedalWalker) -> None:
    snapshots = []
    for action in 0.1 * _actions(150):
        snapshots.append((walker.snapshot(), walker.digest()))
        if walker.step(action)[2]:
            break
    for snapshot, digest in (snapshots[3], snapshots[-1], snapshots[1]):
        walker.restore(snapshot)
        assert walker.digest() == digest


def test_a_split_has_both_legs_on_the_ground_and_the_hull_above_it(walker: BipedalWalker) -> None:
    walker.reset(seed=0)
    standing = _value(walker, "height")
    walker.reset(seed=0, options={"start": "split"})
    assert _value(walker, "height") < 0.75 * standing
    poses, hull = walker.read_poses(), walker.read_poses()[0]
    # One leg in front of the hull on its foot, one behind on its knee.
    assert poses[4, 0] < hull[0] - 0.5 < hull[0] + 0.5 < poses[2, 0]
    ended = [walker.step(np.zeros(4, np.float32))[2] for _ in range(3)]
    assert not any(ended)


def test_an_unknown_start_is_refused(walker: BipedalWalker) -> None:
    with pytest.raises(RobotError, match="no start 'handstand'; available: split"):
        walker.reset(seed=0, options={"start": "handstand"})


def test_stronger_motors_lift_more(walker: BipedalWalker) -> None:
    def speed(torque: float) -> float:
        robot = BipedalWalker(torque=torque)
        robot.reset(seed=0)
        for _ in range(6):
            robot.step(np.array([0.0, 1.0, 0.0, 1.0], np.float32))
        return _value(robot, "vz")

    assert speed(300.0) > speed(80.0)


def test_what_is_drawn_is_where_the_hull_is(walker: BipedalWalker) -> None:
    pose = walker.read_poses()[0]
    assert pose[2] == pytest.approx(_value(walker, "height"))
    walker.world.hull.angle = -0.5  # leans forward
    assert _value(walker, "pitch") == pytest.approx(0.5)
    w, y = walker.read_poses()[0, [3, 5]]
    assert 2 * np.arctan2(y, w) == pytest.approx(0.5)


def test_it_passes_the_finish_and_goes_on() -> None:
    from pdtui.policies.weights.policy_loading import load_policy

    robot = BipedalWalker()
    policy = load_policy("bipedal_walker", "bipedal_walker")
    observation, _ = robot.reset(seed=4)
    finished = False
    for _ in range(robot.episode_steps):
        observation, _, fell, _, info = robot.step(policy.act(observation).action)
        assert not fell
        if finished:
            break
        finished = info.get("outcome") == "arrived"
    assert finished
    assert robot.world.hull.position.x > FINISH
