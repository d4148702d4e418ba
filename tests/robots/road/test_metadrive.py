"""A car on MetaDrive's roads, with the policy that comes in MetaDrive's wheel."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome
from pdtui.core.units import Stimulation, parse_unit
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import ObservationActionSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots.road.metadrive_repairs import FIRST_OTHER_CAR, FIRST_RAY, repair_observation
from pdtui.search.task_rollout import StimulationWithDuration, judge_stimulations

pytest.importorskip("metadrive", reason="the extra 'driving' is not installed")

from pdtui.robots.metadrive import MetaDrive

AHEAD = np.array([0.0, 0.6], np.float32)
LEFT = np.array([0.5, 0.6], np.float32)


@pytest.fixture(scope="module")
def car() -> Iterator[MetaDrive]:
    robot = MetaDrive()
    yield robot
    robot.close()


@pytest.fixture(scope="module")
def expert(car: MetaDrive) -> Policy:
    return load_policy("metadrive:expert", "metadrive", spaces=ObservationActionSpaces.of_world(car))


def _drive(car: MetaDrive, steps: int) -> list[tuple[int, float, Floats]]:
    return [(car.digest(), car.step(AHEAD)[1], car.read_attributes()) for _ in range(steps)]


def test_a_rewind_in_traffic_repeats_every_bit(car: MetaDrive) -> None:
    car.reset(seed=0, options={"start": "test-1"})
    _drive(car, 20)
    kept = car.snapshot()
    first = _drive(car, 20)
    car.restore(kept)
    again = _drive(car, 20)
    assert [row[:2] for row in again] == [row[:2] for row in first]
    assert all(np.array_equal(one[2], other[2]) for one, other in zip(first, again, strict=True))


def test_the_world_says_how_an_episode_ended(car: MetaDrive) -> None:
    car.reset(seed=4, options={"start": "straight"})
    ended, cost = False, 0.0
    while not ended:
        _, _, terminated, truncated, info = car.step(LEFT)
        ended, cost = terminated or truncated, cost + info["cost"]
    assert (info["outcome"], cost) == (Outcome.LEFT_ROAD, 1.0)
    car.reset(seed=2, options={"start": "quiet"})
    ended = False
    while not ended:
        car.ask_rules()
        _, _, terminated, truncated, info = car.step(car.receive_suggestion())
        ended = terminated or truncated
    assert info["outcome"] == Outcome.ARRIVED
    assert car.read_attributes()[car.attribute_index("route")] > 0.9


def test_attributes_are_on_the_scale_that_the_policy_observes(car: MetaDrive) -> None:
    car.reset(seed=7, options={"start": "straight"})
    for step in range(30):
        car.step(LEFT if step % 7 == 0 else AHEAD)
    values = car.read_attributes()
    observed = {
        "speed": 3,
        "lane offset": 8,
        "left distance": 0,
        "right distance": 1,
        "steering": 5,
        "throttle": 6,
    }
    for name, place in observed.items():
        column = car.attribute_index(name)
        compared = car.attributes[column].as_observed(values[column])
        assert compared == pytest.approx(car.observe()[place], abs=1e-5), name


def test_a_car_that_turns_left_moves_to_the_left_in_every_sense(car: MetaDrive) -> None:
    car.reset(seed=7, options={"start": "straight"})
    _drive(car, 20)
    before = dict(zip((one.name for one in car.attributes), car.read_attributes().tolist(), strict=True))
    y = car.read_poses()[0, 1]
    for _ in range(8):
        car.step(np.array([0.15, 0.5], np.float32))
    after = dict(zip((one.name for one in car.attributes), car.read_attributes().tolist(), strict=True))
    assert after["heading"] > 0.02
    assert after["yaw rate"] > 0.02
    assert after["left distance"] < before["left distance"]
    assert after["lane offset"] > before["lane offset"]
    assert car.read_poses()[0, 1] > y


def test_the_units_of_the_paper_brake_and_change_lanes(car: MetaDrive, expert: Policy) -> None:
    """Li et al. (2022) name 0:249 for braking and 0:1 for steering."""
    car.allow_near_restores()
    for task, unit, value, steps in (("brake", "0:249", -20.0, 12), ("lane left", "0:1", -8.5, 8)):
        plan = StimulationWithDuration(Stimulation.of({parse_unit(unit, expert.layers): value}), steps)
        plans = [plan, StimulationWithDuration()]
        rows = [judge_stimulations(car, expert, car.find_task(task), plans, seed) for seed in (1000, 1001)]
        assert [[verdict.success for verdict in row] for row in rows] == [[True, False]] * 2, task


def test_a_near_restore_is_as_near_as_the_car_says(car: MetaDrive) -> None:
    deviation = car.allow_near_restores()
    car.reset(seed=5, options={"start": "straight"})
    for action in (LEFT, AHEAD, LEFT, *[AHEAD] * 17):
        car.step(action)
    kept, first = car.snapshot(), _drive(car, 60)
    car.restore(kept)
    again = _drive(car, 60)
    off = max(np.abs(one[2] - other[2]).max() for one, other in zip(first, again, strict=True))
    assert off <= deviation


def test_roads_and_traffic_are_shown(car: MetaDrive) -> None:
    car.reset(seed=0, options={"start": "test-1"})
    kinds = {line.kind for line in car.scenery.lines}
    assert {"solid lane line", "broken lane line", "route"} <= kinds
    traffic = car.read_traffic()
    assert "vehicle" in traffic.kinds
    place = car.read_poses()[0, :2]
    route = next(line.points for line in car.scenery.lines if line.kind == "route")
    assert np.linalg.norm(route - place, axis=1).min() < 10.0
    assert np.linalg.norm(traffic.lidar_hits - place, axis=1).max(initial=0.0) <= 50.0


def test_an_unknown_scene_is_refused_with_those_that_there_are(car: MetaDrive) -> None:
    with pytest.raises(RobotError, match=r"metadrive: no start 'test-20'; available: .*test-19"):
        car.reset(options={"start": "test-20"})


def test_sideways_quantities_are_turned_round() -> None:
    observed = np.random.default_rng(0).uniform(0.1, 0.9, 275).astype(np.float32)
    observed[FIRST_OTHER_CAR + 4 : FIRST_RAY] = 0.0  # one other car
    repaired = repair_observation(observed)
    changed = set(np.flatnonzero(repaired[:FIRST_RAY] != observed[:FIRST_RAY]).tolist())
    assert changed == {10, 15, FIRST_OTHER_CAR + 1, FIRST_OTHER_CAR + 3}
    assert repaired[FIRST_RAY] == observed[FIRST_RAY]
    assert repaired[FIRST_RAY + 60] == observed[-60]  # 90° to the right was 90° to the left
