"""Worlds in another process are the same worlds."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from pdtui.core.errors import RobotError, TrainingError
from pdtui.core.processes.worker_pool import WorkerProcess
from pdtui.robots import make_robot

pytest.importorskip("jax", reason="the extra 'train' is not installed")

from pdtui.training.remote.remote_robot_batch import RemoteRobotBatch
from pdtui.training.robot_batch import RobotBatch


def test_they_step_alike_and_go_on_from_a_kept_state() -> None:
    here, there = RobotBatch(partial(make_robot, "ant"), 2, 5), RemoteRobotBatch("ant", {}, 2, 5)
    actions = np.random.default_rng(0).uniform(-1, 1, (12, 2, 8)).astype(np.float32)
    for action in actions[:6]:
        for mine, theirs in zip(here.step(action), there.step(action), strict=True):
            np.testing.assert_array_equal(mine, theirs)
    kept = there.state()
    first = [there.step(action) for action in actions[6:]]
    there.restore(kept)
    for action, expected in zip(actions[6:], first, strict=True):
        for again, rows, local in zip(there.step(action), expected, here.step(action), strict=True):
            np.testing.assert_array_equal(again, rows)
            np.testing.assert_array_equal(local, rows)
    np.testing.assert_array_equal(here.observations, there.observations)
    np.testing.assert_array_equal(here.restarted, there.restarted)


def test_what_goes_wrong_there_is_heard_here() -> None:
    with pytest.raises(RobotError, match="unknown robot 'nobody'"):
        RemoteRobotBatch("nobody", {}, 1, 0)
    worlds = RemoteRobotBatch("ant", {}, 1, 0)
    assert isinstance(worlds.worker, WorkerProcess)
    worlds.worker.process.kill()
    worlds.worker.process.join()
    with pytest.raises(
        TrainingError, match=r"worlds of ant: .* SIGKILL.*continue the run from its last checkpoint"
    ):
        worlds.step(np.zeros((1, 8), np.float32))
