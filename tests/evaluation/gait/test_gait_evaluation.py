"""Gaits of real robots, of one whose steps are known, and of those that have no feet."""

from __future__ import annotations

import json
from contextlib import closing
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
import torch
from click.testing import CliRunner
from rich.console import Console

from pdtui.api import load_policy
from pdtui.cli import main
from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import RobotError
from pdtui.core.robot_links_and_state import Foot, Link, RobotState
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.evaluation.gait.gait_evaluation import evaluate_gait
from pdtui.evaluation.gait.gait_tables import gait_tables
from pdtui.evaluation.gait.walk_metrics import find_foot_links
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map, parse_map

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
CYCLE = 20  # control steps


class Stepper(Robot):
    """Walks at 1 m/s on two feet, each down for 0.6 and lifted to 0.2 m for 0.4 of a cycle of 0.4 s."""

    name = "stepper"
    title = "Stepper"
    links = (
        Link("trunk", 0, "sphere", (0.1,), (0.0, 0.0, 0.0), UPRIGHT),
        Link("left sole", 1, "sphere", (0.05,), (0.0, 0.0, 0.0), UPRIGHT),
        Link("right sole", 2, "sphere", (0.05,), (0.0, 0.0, 0.0), UPRIGHT),
    )
    feet: tuple[Foot, ...] = (Foot("left foot", "left sole"), Foot("right foot", "right sole"))
    attributes = (Attribute("left contact", ""), Attribute("right contact", ""))
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,), np.float64)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
    control_dt = 0.02
    _step = 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Floats, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self._step = 0
        return self.observe(), {}

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        del action
        self._step += 1
        return self.observe(), 0.0, False, False, {"cost": 0.0}

    def observe(self) -> Floats:
        return np.array([float(self._step)])

    def read_attributes(self) -> Floats:
        return np.array([float(phase < 12) for phase in self._phases()])

    def read_poses(self) -> Floats:
        poses = np.tile((0.0, 0.0, 0.0, *UPRIGHT), (3, 1))
        poses[0, 0], poses[0, 2] = self.control_dt * self._step, 1.0
        for row, phase in enumerate(self._phases(), start=1):
            stood = self._step - min(phase, 12)
            poses[row, 0] = self.control_dt * stood
            poses[row, 2] = 0.05 + (0.0 if phase < 12 else 0.2 * np.sin(np.pi * (phase - 11) / 9))
        return poses

    def _phases(self) -> list[int]:
        return [self._step % CYCLE, (self._step + CYCLE // 2) % CYCLE]

    def snapshot(self) -> RobotState:
        return RobotState(self.name, self.observe(), (), self.np_random.bit_generator.state)

    def restore(self, snapshot: RobotState) -> None:
        self._step = int(snapshot.state[0])

    def digest(self) -> int:
        return self._step


class SensingStepper(Stepper):
    """The same with contacts among its attributes."""

    feet = (
        Foot("left foot", "left sole", contact="left contact"),
        Foot("right foot", "right sole", contact="right contact"),
    )


MAP = """
schema = 1
robot = "stepper"
[policy]
name = "none"
sha256 = "none"
[[behaviors]]
name = "nothing"
key = "k"
magnitudes = {"0:0" = 1.0}
"""


def _loop(robot: Robot) -> ControlLoop:
    network = torch.nn.Sequential(torch.nn.Linear(1, 2), torch.nn.Tanh(), torch.nn.Linear(2, 1))
    return ControlLoop(robot, load_policy(network, robot), parse_map(MAP, "test"), 0)


@pytest.mark.parametrize(("robot", "by"), [(Stepper(), "height"), (SensingStepper(), "simulator")])
def test_a_walk_whose_steps_are_known(robot: Stepper, by: str) -> None:
    result = evaluate_gait(_loop(robot), (5, 6), steps=400)
    assert result.contacts_by == by
    assert result.speed.mean == pytest.approx(1.0)
    assert (result.airborne.mean, result.tilt.mean) == (0.0, 0.0)
    assert result.feet_down == pytest.approx((0.0, 0.8, 0.2))
    assert result.alternation is not None
    assert result.alternation.mean == 1.0
    assert (result.gait, result.lags) == ("", ())
    for foot in result.feet:
        assert foot.touchdown_rate.mean == pytest.approx(2.5, abs=0.15)
        assert foot.duty_factor.mean == pytest.approx(0.6)
        assert foot.clearance.mean == pytest.approx(0.2, abs=0.01)
        assert foot.slip.mean == pytest.approx(0.0, abs=1e-9)
        assert foot.touchdown_rate.deviation == 0.0
    console = Console(width=120, record=True, file=None)
    with console.capture() as shown:
        console.print(gait_tables(result))
    assert ("Contacts are estimated" in shown.get()) is (by == "height")
    assert "100% ± 0% of touchdowns" in shown.get()


@pytest.fixture(scope="module")
def anymal() -> ControlLoop:
    return build_control_loop(DriveConfig("anymal", load_map(find_map("anymal")), 0))


def test_anymal_trots_and_lifts_its_front_feet_high(anymal: ControlLoop) -> None:
    result = evaluate_gait(anymal, (1500,), steps=300)
    assert result.contacts_by == "simulator"
    assert result.gait == "trot"
    assert [foot.name for foot in result.feet] == ["LF", "RF", "LH", "RH"]
    assert all(foot.slip.mean < 0.2 for foot in result.feet)
    assert all(foot.clearance.mean > 0.3 for foot in result.feet[:2])
    assert sum(result.feet_down) == pytest.approx(1.0)
    assert 0.8 < result.speed.mean < 1.2


@pytest.mark.parametrize("name", ["ant", "walker", "bipedal_walker", "a1", "anymal", "anymal-forward"])
def test_every_walking_robot_says_what_it_walks_on(name: str) -> None:
    if name == "a1":
        pytest.importorskip("pybullet", reason="PyBullet has no wheels for every Python")
    with closing(make_robot(name)) as robot:
        links = find_foot_links(robot)
        assert len(links) == len(robot.feet) in (2, 4)
        robot.reset(seed=0)
        contacts = robot.read_foot_contacts()
        assert contacts is not None
        assert len(contacts) == len(links)


def test_a_robot_that_stands_touches_the_ground_with_all_feet() -> None:
    robot: Any = make_robot("anymal")
    robot.reset(seed=0)
    for _ in range(60):
        robot.step(np.zeros(12, np.float32))
    assert robot.read_foot_contacts() == [True] * 4
    robot.data.qpos[2] += 1.0
    mujoco.mj_forward(robot.model, robot.data)
    assert robot.read_foot_contacts() == [False] * 4


def test_a_robot_without_feet_says_so() -> None:
    robot = Stepper()
    robot.feet = ()
    with pytest.raises(RobotError, match=r"stepper: expected a robot that says in `feet`"):
        evaluate_gait(_loop(robot), (5,))
    robot.feet = (Foot("paw", "hand"),)
    with pytest.raises(RobotError, match="foot 'paw': no link 'hand'; available: trunk, left sole"):
        evaluate_gait(_loop(robot), (5,))


def test_the_command_prints_the_gait() -> None:
    shown = CliRunner().invoke(main, ["evaluate", "walker", "--gait", "--seeds", "1500", "--json"])
    assert shown.exit_code == 0, shown.output
    data = json.loads(shown.output)
    assert [foot["name"] for foot in data["feet"]] == ["right foot", "left foot"]
    assert data["airborne"]["mean"] == pytest.approx(data["feet_down"][0])
    refused = CliRunner().invoke(main, ["evaluate", "walker", "--gait", "--quick"])
    assert "--gait and --quick are mutually exclusive" in refused.output
