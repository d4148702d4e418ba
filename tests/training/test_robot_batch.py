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
from tests.batch_agreement import check_worlds_are_the_same


def test_they_step_alike_and_go_on_from_a_kept_state() -> None:
    here, there = RobotBatch(partial(make_robot, "ant"), 2, 5), RemoteRobotBatch("ant", {}, 2, 5)
    check_worlds_are_the_same(here, there)
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
