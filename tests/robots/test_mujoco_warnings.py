"""MuJoCo's handler of warnings belongs to the process: robots leave it alone, and print nothing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

DIVERGES = """
import mujoco
heard = []
mujoco.set_mju_user_warning({handler})
before = mujoco.get_mju_user_warning()
import numpy as np
from pdtui.core.errors import SimulationDiverged
from pdtui.robots import make_robot
robot = make_robot("{robot}")
for rewound in (False, True):
    robot.reset(seed=0)
    if rewound:
        robot.restore(robot.snapshot())
    data = getattr(robot, "world", robot).data
    data.qvel[:] = np.nan
    try:
        robot.step(np.zeros(robot.action_space.shape, np.float32))
        raise AssertionError("it did not diverge")
    except SimulationDiverged as error:
        assert "{robot}: the simulation diverged" in str(error), error
assert mujoco.get_mju_user_warning() is before
assert not heard, heard
"""


@pytest.mark.parametrize(
    ("robot", "handler"),
    [("ant", "None"), ("walker", "heard.append"), ("anymal", "None"), ("Hopper-v5", "heard.append")],
)
def test_a_diverging_simulation_is_reported_without_the_processes_handler(
    robot: str, handler: str, tmp_path: Path
) -> None:
    code = DIVERGES.format(robot=robot, handler=handler)
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    assert list(tmp_path.iterdir()) == []  # no MUJOCO_LOG.TXT either
