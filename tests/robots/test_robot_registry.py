"""From a name to a robot: which code a name may choose, and what a wrong one says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pdtui.core.errors import RobotError
from pdtui.robots import make_robot, require_robot_name, robot_file_stem

GUIDE = Path(__file__).parents[2] / "pdtui" / "guide" / "your-world.md"
MODULE = """\
import pathlib
import gymnasium
pathlib.Path("imported").touch()
gymnasium.register("Thing-v0", "gymnasium.envs.classic_control.pendulum:PendulumEnv")
"""


def run_python(code: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run code in a fresh process that finds what is installed in a folder."""
    path = os.pathsep.join([str(folder), str(GUIDE.parents[2])])
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def install(folder: Path, name: str, value: str, module: str = "") -> None:
    """Put a module and a distribution with an entry point into a folder, as pip would."""
    info = folder / "some_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: some-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[pdtui.robots]\n{name} = {value}\n")
    if module:
        (folder / f"{value.partition(':')[0]}.py").write_text(module)


def test_an_unknown_name_lists_close_ones() -> None:
    with pytest.raises(RobotError, match="unknown robot 'Hoper-v5'; did you mean Hopper-v5"):
        make_robot("Hoper-v5")
    with pytest.raises(RobotError, match="unknown robot 'qqqqqqqq'; available: a1, a1-vision, ant, anymal, "):
        require_robot_name("qqqqqqqq")
    with pytest.raises(RobotError, match="unknown robot 'Hopper'"):
        require_robot_name("Hopper")  # a map must say which version its numbers hold for


def test_an_environment_that_needs_more_says_what_to_install(tmp_path: Path) -> None:
    """As where the library is missing: a module that cannot be imported stands in its place."""
    (tmp_path / "Box2D.py").write_text("raise ImportError('no Box2D here')\n")
    code = "from pdtui.robots import make_robot; make_robot('LunarLander-v3')"
    result = run_python(code, tmp_path)
    assert result.returncode != 0
    last = result.stderr.strip().splitlines()[-1]
    assert "environment 'LunarLander-v3' needs a package that is not installed" in last
    assert "gymnasium[box2d]" in last


def test_a_module_is_not_imported_because_a_name_says_so(tmp_path: Path) -> None:
    (tmp_path / "things.py").write_text(MODULE)
    code = "from pdtui.robots import make_robot; make_robot('things:Thing-v0')"
    result = run_python(code, tmp_path)
    assert "RobotError: robot 'things:Thing-v0': the module 'things' is not imported because" in result.stderr
    assert not (tmp_path / "imported").exists()


def test_a_module_that_the_user_named_is_imported(tmp_path: Path) -> None:
    (tmp_path / "things.py").write_text(MODULE)
    code = "from pdtui.robots import make_robot; print(make_robot('things:Thing-v0').name)"
    assert run_python(code, tmp_path, PDTUI_ENVIRONMENT_MODULES="json,things").stdout == "things:Thing-v0\n"
    trusting = code.replace("import", "import trust_module,", 1).replace(
        "; ", "; trust_module('things:'); ", 1
    )
    assert run_python(trusting, tmp_path).stdout == "things:Thing-v0\n"


def test_a_module_that_is_imported_already_is_looked_up(tmp_path: Path) -> None:
    (tmp_path / "things.py").write_text(MODULE)
    code = "import things; from pdtui.robots import require_robot_name as r; print(r('things:Thing-v0'))"
    assert run_python(code, tmp_path).stdout == "things:Thing-v0\n"


def test_the_guides_example_is_a_robot(tmp_path: Path) -> None:
    found = re.search(r"```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert found is not None
    assert len(found[1].splitlines()) <= 30
    install(tmp_path, "pendulum", "pendulum_robot:Pendulum", found[1])
    result = run_python(
        """
import numpy as np
from pdtui.robots import make_robot
robot = make_robot("pendulum")
robot.reset(seed=1)
for _ in range(20):
    robot.step(np.array([1.5], np.float32))
values = dict(zip([a.name for a in robot.attributes], robot.read_attributes()))
assert values["torque"] == 1.5, values
observed = robot.observe()
assert np.allclose([np.cos(values["angle"]), np.sin(values["angle"])], observed[:2], atol=1e-6), values
assert np.isclose(values["angular velocity"], observed[2]), values
from pdtui.robots.geometry import capsule_ends, compute_link_poses
tip = capsule_ends(robot.links, compute_link_poses(robot.links, robot.read_poses()))[0, 1]
assert np.allclose(tip, [np.sin(values["angle"]), 0, 1.2 + np.cos(values["angle"])]), tip
snapshot = robot.snapshot()
ahead = [robot.step(np.array([-1.0], np.float32))[1] for _ in range(20)]
robot.restore(snapshot)
assert ahead == [robot.step(np.array([-1.0], np.float32))[1] for _ in range(20)]
print(robot.title)
""",
        tmp_path,
    )
    assert result.stdout == "Pendulum\n", result.stderr


@pytest.mark.parametrize(
    ("value", "module", "said"),
    [
        ("nowhere:Thing", "", "cannot be built: ModuleNotFoundError: No module named 'nowhere'"),
        ("things:Thing", "", "cannot be built: AttributeError"),
        ("things:Thing", "Thing = dict\n", "expected a pdtui.robots.Robot, found dict"),
        ("things:Thing", "def Thing():\n    1 / 0\n", "cannot be built: ZeroDivisionError: division by zero"),
        (
            "things:Thing",
            "from pdtui.robots.ant import Ant as Thing\n",
            "expected the class to have that name, found 'ant'",
        ),
    ],
)
def test_a_broken_entry_point_is_named_with_its_package(
    value: str, module: str, said: str, tmp_path: Path
) -> None:
    install(tmp_path, "broken", value, module)
    if not module and value.startswith("things"):
        (tmp_path / "things.py").write_text("")
    result = run_python("from pdtui.robots import make_robot; make_robot('broken')", tmp_path)
    last = result.stderr.strip().splitlines()[-1]
    assert f"robot 'broken' (entry point {value} of some-package): {said}" in last


def test_a_name_becomes_part_of_a_file_name() -> None:
    assert robot_file_stem("Hopper-v5") == "Hopper-v5"
    assert robot_file_stem("a.b:ALE/Pong-v5") == "a.b-ALE-Pong-v5"


ROBOT = '''
import math

import gymnasium
import numpy as np

from pdtui.core.attributes import Attribute, BehaviorAim
from pdtui.core.robot_links_and_state import Link, RobotState
from pdtui.robots.robot import Robot
from pdtui.robots.robot_goals import BehaviorGoal, RobotGoals
from pdtui.robots.task import Task, TaskVerdict
from pdtui.robots.training_recipe import TrainingRecipe


def runs_away(trace):
    """It is ten meters from where it was."""
    way = float(trace["place"][-1] - trace.before("place")[-1])
    return TaskVerdict(way > 10.0, way / 10.0, {"way (m)": way})


class Cart(Robot):
    name = "iron-cart"
    title = "Cart"
    attributes = (Attribute("place", "m"), Attribute("speed", "m/s"))
    links = (Link("cart", 0, "box", (0.2, 0.1, 0.1), (0.0, 0.0, 0.1), (1.0, 0.0, 0.0, 0.0)),)
    starts = ("moving",)
    goals = RobotGoals(
        behaviors=(BehaviorGoal("rush", "r", "rushes on", BehaviorAim("speed", "raise"), 0.25),),
        primitives={"speed": "pace"},
    )
    tasks = (Task("run", "n", "runs away", "10 m", (1, 3), 50, runs_away, start="moving"),)
    training_recipe = TrainingRecipe(settings={"total_steps": 64, "worlds": 2, "chunk": 16, "minibatch": 16,
        "layers": (4, 4), "evaluate_every": 64, "evaluate_episodes": 1, "evaluate_steps": 5})
    control_dt = 0.1
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        start = self.check_start((options or {}).get("start", ""))
        self.state = np.array([0.0, 1.0 if start else 0.0])
        return self.observe(), {}

    def step(self, action):
        speed = self.state[1] + self.control_dt * (float(action[0]) - self.state[1])
        self.state = np.array([self.state[0] + self.control_dt * speed, speed])
        return self.observe(), speed, False, False, {"cost": 0.0}

    def observe(self):
        return self.state.copy()

    def read_attributes(self):
        return self.state.copy()

    def read_poses(self):
        return np.array([[self.state[0], 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])

    def snapshot(self):
        return RobotState(self.name, self.state.copy(), (), self.np_random.bit_generator.state)

    def restore(self, snapshot):
        self.state = snapshot.state.copy()

    def digest(self):
        return int.from_bytes(self.state.tobytes(), "little") % 2**63
'''
USES = """
import sys
from pathlib import Path
{prepare}
from pdtui.robots import require_robot_name, make_robot, list_robot_names
assert require_robot_name("iron-cart") in list_robot_names()
assert not {{"gymnasium", "mujoco"}} & set(sys.modules)
import numpy as np
from pdtui.core.units import NO_STIMULATION
from pdtui.dissection.dissect import dissect
from pdtui.dissection.dissection_config import DissectionConfig
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import drive_headless
from pdtui.driving.loop_builder import build_control_loop
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.search.task_rollout import StimulationWithDuration, judge_stimulations
from pdtui.stimulation.map_library import map_without_behaviors
from tests.small_dissection import SMALL
{train}
robot, policy = make_robot("iron-cart"), load_policy(weights, "iron-cart")
assert robot.training_recipe.settings["total_steps"] == 64
assert policy.layers == (4, 4)
alone = map_without_behaviors("iron-cart", str(weights))
loop = build_control_loop(DriveConfig("iron-cart", alone, 3, start="moving"))
assert drive_headless(loop, {{}}, 40, None).steps == 40
(verdict,) = judge_stimulations(robot, policy, robot.find_task("run"), [StimulationWithDuration()], 0)
assert list(verdict.figures) == ["way (m)"]
found = dissect(DissectionConfig(robot, policy, episodes=1, settings=SMALL, budget_minutes=0.0))
assert [one.goal.name for one in found.behaviors] == ["rush"] and not found.controllers
print("whole")
"""


TRAIN = """
from pdtui.training.train_policy import train_policy
weights = train_policy("iron-cart", "ppo", 1, None, None, None, Path("run"), None)
"""
SAVE = """
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
weights = Path("cart.safetensors")
save_network(weights, PolicyNetwork(NetworkSpec("iron-cart", 2, (4, 4), "tanh", 1, "mean", (-1.0,), (1.0,))))
"""


@pytest.mark.parametrize("own", [True, False], ids=["in the package", "by entry point"])
def test_one_file_adds_a_robot_with_its_goals_tasks_and_training(own: bool, tmp_path: Path) -> None:
    if own:
        (tmp_path / "more").mkdir()
        (tmp_path / "more" / "iron_cart.py").write_text(ROBOT)
        prepare, train = "import pdtui.robots; pdtui.robots.__path__.append('more')", SAVE
    else:
        pytest.importorskip("jax", reason="the extra 'train' is not installed")
        install(tmp_path, "iron-cart", "cart_module:Cart", ROBOT)
        prepare, train = "", TRAIN
    result = run_python(USES.format(prepare=prepare, train=train), tmp_path)
    assert result.stdout == "whole\n", result.stderr
