"""Edits of what the car observes, against the observation of a car that was really moved in the engine."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("metadrive", reason="the extra 'driving' is not installed")

from pdtui.core.attributes import Floats
from pdtui.core.processes.worker_pool import WorkerProcess
from pdtui.robots.metadrive import MetaDrive
from pdtui.robots.road.car_observation_edits import CAR_OBSERVATION_EDITS
from pdtui.robots.road.metadrive_repairs import FIRST_OTHER_CAR, repair_observation
from pdtui.robots.road.road_world import RoadWorld

EDITS = {edit.name: edit.apply for edit in CAR_OBSERVATION_EDITS}
CHECKPOINTS = slice(9, 19)
# The engine computes in single precision, at places some hundred meters from its origin.
PRECISION = 2e-5


class MovableCarWorld(RoadWorld):
    """A road on which the car can be put elsewhere."""

    def observe_moved(self, left: float, turn: float, speed: float) -> Floats:
        """Put the car further to the left (m), turn it to the left (rad) and change its speed (m/s).

        Returns:
            What it observes then of itself and of its road, shape (19,). It is put back.
        """
        car = self._env.agent
        kept = np.array(car.position), car.heading_theta, np.array(car.velocity)
        last_heading = np.array(car.last_heading_dir)
        along, _ = car.lane.local_coordinates(kept[0])
        sideways = car.lane.heading_theta_at(along) + math.pi / 2
        c, s = math.cos(turn), math.sin(turn)
        self._put(kept[0] + left * np.array([math.cos(sideways), math.sin(sideways)]), kept[1] + turn)
        # Turned as a whole, it turns no faster.
        car.last_heading_dir = np.array([[c, -s], [s, c]]) @ last_heading
        velocity = kept[2] * (1.0 + speed / np.linalg.norm(kept[2]))
        car.set_velocity(velocity)
        observed = np.array(self._env.observations["default_agent"].observe(car))
        car.set_velocity(kept[2])
        self._put(kept[0], kept[1])
        car.last_heading_dir = last_heading
        return repair_observation(observed)[:FIRST_OTHER_CAR].astype(np.float64)

    def _put(self, place: Floats, heading: float) -> None:
        car = self._env.agent
        car.set_position(place)
        car.set_heading_theta(heading)
        car.navigation.update_localization(car)
        car.update_dist_to_left_right()


class MovableCar:
    """The road in a process of its own."""

    def __init__(self) -> None:
        self._process = WorkerProcess("the roads of a test", MovableCarWorld, False)

    def drive(self, start: str, seed: int, actions: list[tuple[float, float]]) -> Floats:
        """Return the observation at the end, shape (275,)."""
        self._process.send(RoadWorld.reset, start, seed, False)
        state = self._process.receive()
        for action in actions:
            self._process.send(RoadWorld.step, np.array(action, np.float32))
            state = self._process.receive()
        return np.asarray(state.observation, np.float64)

    def drive_by_rules(self, start: str, seed: int, steps: int) -> Floats:
        """Let MetaDrive's rule-based driver drive, and return the observation at the end, shape (275,)."""
        observation = self.drive(start, seed, [])
        for _ in range(steps):
            self._process.send(RoadWorld.suggest_action)
            self._process.send(RoadWorld.step, self._process.receive())
            observation = np.asarray(self._process.receive().observation, np.float64)
        return observation

    def observe_moved(self, left: float = 0.0, turn: float = 0.0, speed: float = 0.0) -> Floats:
        self._process.send(MovableCarWorld.observe_moved, left, turn, speed)
        return np.asarray(self._process.receive())

    def close(self) -> None:
        self._process.close()


@pytest.fixture(scope="module")
def car() -> Iterator[MovableCar]:
    movable = MovableCar()
    yield movable
    movable.close()


@pytest.fixture
def askew(car: MovableCar) -> Floats:
    """The observation of a car that is turned to the left a little, on a straight road."""
    observation = car.drive("straight", 1042, [(0.0, 0.6)] * 40 + [(0.15, 0.5)] * 6)
    assert 0.02 < 0.5 - observation[2] < 0.3
    np.testing.assert_allclose(car.observe_moved(), observation[:FIRST_OTHER_CAR], atol=PRECISION)
    return observation


def _near(observation: Floats) -> list[int]:
    """Return all places of the observation but those of checkpoints that are 50 m or more away."""
    far = [first for first in (9, 14) if np.hypot(*(2 * observation[first : first + 2] - 1)) > 0.999]
    return [place for place in range(FIRST_OTHER_CAR) if not any(0 <= place - first < 2 for first in far)]


@pytest.mark.parametrize("offset", [-4.0, -1.2, 0.8, 2.5])
def test_a_car_that_is_further_to_the_side_observes_what_the_edit_says(
    car: MovableCar, askew: Floats, offset: float
) -> None:
    edited, real = EDITS["sideways offset"](askew, offset)[:FIRST_OTHER_CAR], car.observe_moved(left=offset)
    places = _near(askew)
    np.testing.assert_allclose(edited[places], real[places], atol=PRECISION)
    assert np.abs(edited - real).max() < 0.5 * abs(offset) / 50.0
    assert np.abs(real - askew[:FIRST_OTHER_CAR]).max() > 0.04


def test_the_nearest_checkpoint_moves_to_the_other_side(car: MovableCar) -> None:
    observation = car.drive("straight", 1042, [(0.0, 0.8)] * 90)
    assert {9, 10} < set(_near(observation)), "the end of the road must be near"
    edited, real = EDITS["sideways offset"](observation, 1.5)[:FIRST_OTHER_CAR], car.observe_moved(left=1.5)
    np.testing.assert_allclose(edited[_near(observation)], real[_near(observation)], atol=PRECISION)
    assert edited[10] > observation[10] + 0.01


@pytest.mark.parametrize("angle", [-0.4, 0.3])
def test_a_car_that_is_turned_observes_what_the_edit_says(
    car: MovableCar, askew: Floats, angle: float
) -> None:
    edited = EDITS["heading offset"](askew, angle)[:FIRST_OTHER_CAR]
    np.testing.assert_allclose(edited, car.observe_moved(turn=angle), atol=PRECISION)
    assert np.abs(edited[CHECKPOINTS] - askew[CHECKPOINTS]).max() > 0.1


@pytest.mark.parametrize("faster", [-3.0, 2.0])
def test_a_faster_car_observes_what_the_edit_says(car: MovableCar, askew: Floats, faster: float) -> None:
    real = car.observe_moved(speed=faster)
    np.testing.assert_allclose(EDITS["speed offset"](askew, faster)[:FIRST_OTHER_CAR], real, atol=PRECISION)
    speed = (81.0 * real[3] - 1.0) / 3.6
    np.testing.assert_allclose(EDITS["speed"](askew, speed)[:FIRST_OTHER_CAR], real, atol=PRECISION)


def test_both_together_in_a_bend(car: MovableCar) -> None:
    observation = car.drive_by_rules("quiet", 1041, 75)
    assert observation[11] > 0.1, "the radius of the bend must be that of a bend"
    edited = EDITS["heading offset"](EDITS["sideways offset"](observation, -0.9), 0.2)
    real, places = car.observe_moved(left=-0.9, turn=0.2), _near(observation)
    np.testing.assert_allclose(edited[places], real[places], atol=PRECISION)


def test_the_place_in_the_lane_is_set(askew: Floats) -> None:
    scale = next(one for one in MetaDrive.attributes if one.name == "lane offset")
    edited = EDITS["lane offset"](askew, 0.7)
    assert edited[8] == pytest.approx(scale.as_observed(np.array(0.7)))
    moved = (askew[0] - edited[0]) * 18.0
    np.testing.assert_allclose(edited, EDITS["sideways offset"](askew, moved), atol=1e-9)


def test_what_is_seen_of_others_stays_and_all_numbers_stay_in_range(askew: Floats) -> None:
    observation = askew.copy()
    observation[FIRST_OTHER_CAR:] = np.random.default_rng(0).uniform(size=256)
    for name, apply in EDITS.items():
        for size in (-60.0, -1.0, 1.0, 60.0):
            before = observation.copy()
            edited = apply(observation, size)
            np.testing.assert_array_equal(observation, before)
            np.testing.assert_array_equal(edited[FIRST_OTHER_CAR:], observation[FIRST_OTHER_CAR:], name)
            assert edited.min() >= 0.0, name
            assert edited.max() <= 1.0, name
            assert not np.array_equal(edited, observation), name
