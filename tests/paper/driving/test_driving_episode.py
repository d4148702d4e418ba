"""Short drives of the real car: scored as they happen, recorded, and scored again from the session."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.paper.driving.drive_operators import NoOperator, make_operator
from pdtui.paper.driving.driving_episode import read_episode, record_episode
from pdtui.paper.driving.operator_memory import JudgmentErrors
from pdtui.paper.driving.road_sight import SIGHT
from pdtui.paper.driving.sight_reader import SightReader, read_boxes
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.policies.weights.weights_header import hash_file
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_reader import load_map

pytest.importorskip("metadrive", reason="MetaDrive is not installed (the extra 'driving')")

STEPS = 80
MAP = """\
schema = 1
robot = "metadrive"
policy = {{ name = "{policy}", sha256 = "{sha256}" }}
keys = {{ default = "space" }}
"""
BEHAVIOR = """
[[behaviors]]
name = "{name}"
key = "{key}"
says = "does something"
magnitudes = {{ "0:{unit}" = {value} }}
"""
KEYS = {
    "brake": ("s", 1, -3.0),
    "accelerate": ("w", 1, 3.0),
    "lane left": ("a", 0, 0.5),
    "lane right": ("d", 0, -0.5),
}


@pytest.fixture(scope="module")
def map_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy that always steers to the left at full throttle, and a map whose units are its two outputs."""
    folder = tmp_path_factory.mktemp("car")
    spec = NetworkSpec("metadrive", 275, (8,), "tanh", 2, "mean", (-1.0,) * 2, (1.0,) * 2)
    network = PolicyNetwork(spec)
    tensors = {name: tensor * 0 for name, tensor in network.state_dict().items()}
    tensors["normalizer.std"] += 1.0
    tensors["head.weight"][0, 0] = tensors["head.weight"][1, 1] = 1.0
    tensors["head.bias"] += network.head.bias.new_tensor([0.3, 1.0])
    network.load_tensors(tensors)
    weights = folder / "turns.safetensors"
    save_network(weights, network)
    text = MAP.format(policy=weights, sha256=hash_file(weights))
    for name, (key, unit, value) in KEYS.items():
        text += BEHAVIOR.format(name=name, key=key, unit=unit, value=value)
    path = folder / "turns.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def car() -> Iterator[Robot]:
    robot = make_robot("metadrive")
    yield robot
    robot.close()


def _loop(car: Robot, map_path: Path, start: str = "test-7") -> ControlLoop:
    stimulation_map = load_map(map_path)
    return ControlLoop(car, load_policy(stimulation_map.policy, "metadrive"), stimulation_map, 0, start=start)


def test_a_drive_off_the_road_is_scored_recorded_and_scored_again(
    car: Robot, map_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / "off.rrd"
    score = record_episode(_loop(car, map_path), NoOperator(), path, "off")
    assert (score.scene, score.outcome, score.success, score.out_of_road) == (
        "test-7",
        Outcome.LEFT_ROAD,
        False,
        True,
    )
    assert (score.cost, score.involvement, score.presses) == (1.0, 0, 0)
    assert 10 < score.steps < 100
    assert read_episode(path, "metadrive") == (score, "turns", "alone")
    line = (
        "evaluate",
        "metadrive",
        "--map",
        map_path,
        "--experiment",
        "driving",
        "--session",
        path,
        "--json",
    )
    scored = CliRunner().invoke(main, [str(word) for word in line])
    assert scored.exit_code == 0, scored.output
    (row,) = json.loads(scored.stdout)["rows"]
    assert (row["policy"], row["control"], row["driver"]) == ("turns", "alone", "person")
    assert row["scores"][0]["reward"] == pytest.approx(score.reward)


def test_the_wheel_keeps_the_car_on_the_road_and_counts_as_involvement(car: Robot, map_path: Path) -> None:
    loop = _loop(car, map_path)
    operator = make_operator("human only", loop, None, JudgmentErrors())
    records: list[StepRecord] = []
    traffic = car.read_traffic()
    for _ in range(STEPS):
        records.append(loop.advance(operator.act(traffic)))
        traffic = records[-1].traffic
    assert all(record.involved for record in records)
    assert not any(record.ended or record.cost for record in records)
    left, right = (loop.attributes[car.attribute_index(name)] for name in ("left distance", "right distance"))
    assert max(record.attributes[car.attribute_index("speed")] for record in records) > 5.0
    assert min(left, right) > 1.0
    sight = SightReader(car).look(traffic)
    assert (sight.left, sight.right) == (left, right)
    # The road's middle line is as far beside the car as the distances from the edges say.
    assert sight.beside == pytest.approx((right - left) / 2, abs=0.3)
    boxes = np.array(list(read_boxes(car.scenery, traffic).values()))
    distances = np.hypot(*(boxes[:, :2] - car.read_poses()[0, :2]).T)
    assert len(sight.others) == (distances < SIGHT).sum() > 0
    now = sight.foresee(np.zeros(1))[:, 0, :2]
    assert np.hypot(*now.T).min() == pytest.approx(distances.min(), abs=1.0)


def test_only_a_whole_drive_of_a_test_scene_is_scored(car: Robot, map_path: Path, tmp_path: Path) -> None:
    quiet, short = tmp_path / "quiet.rrd", tmp_path / "short.rrd"
    for path, start in ((quiet, "quiet"), (short, "test-7")):
        loop = _loop(car, map_path, start)
        with SessionRecorder(path, replace(loop.info, activations="off")) as recorder:
            for step in range(5):
                recorder.write(loop.advance([DriveEvent(step, "control", "steering", 0.0)]))
    with pytest.raises(SessionError, match="with a start from 'test-0' to 'test-19', found .* start 'quiet'"):
        read_episode(quiet, "metadrive")
    with pytest.raises(SessionError, match="its first episode stops at step 5 and has no outcome"):
        read_episode(short, "metadrive")
    with pytest.raises(SessionError, match="expected a drive of ant"):
        read_episode(short, "ant")
