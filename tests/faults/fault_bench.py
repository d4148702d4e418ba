"""What all kinds of faults share: a folder, a map, random numbers, and a robot that replays."""

from __future__ import annotations

import os
import random
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pdtui.driving.session_replay import replay_session
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_file_lookup import POLICY_FOLDERS_VARIABLE
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.robots.robot import Robot
from pdtui.sessions.session_integrity import examine_session
from pdtui.sessions.session_reader import Session, read_session
from pdtui.sessions.session_repair import repair_session
from pdtui.stimulation.map_reader import load_map
from tests.faults.fault_tally import FalseReport, StepsLost

ROOT = Path(__file__).parents[2]


class FaultBench:
    """Records, breaks and replays drives of the Ant in a folder.

    Args:
        folder: an empty folder.
        map_path: the map.
        seed: of all that is drawn.
    """

    def __init__(self, folder: Path, map_path: Path, seed: int) -> None:
        self.folder, self.map_path, self.drawn = folder, map_path, random.Random(seed)
        self._policy_folder = Path(load_map(map_path).policy).parent

    @cached_property
    def robot(self) -> Robot:
        """One Ant for all replays."""
        return make_robot("ant")

    @cached_property
    def policy(self) -> Policy:
        """The map's policy."""
        return load_policy(load_map(self.map_path).policy, "ant")

    @property
    def environment(self) -> dict[str, str]:
        """The environment of processes, in which sessions find the policy."""
        kept = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
        return {**kept, "PYTHONPATH": str(ROOT), POLICY_FOLDERS_VARIABLE: str(self._policy_folder)}

    def drive_arguments(self, path: Path, *more: str) -> list[str]:
        """Return the arguments of `pdtui` for a drive without a screen that is recorded into a file."""
        return ["drive", "ant", "--map", str(self.map_path), "--headless", "--record", str(path), *more]

    def require_replay(self, path: Path) -> Session:
        """Replay a session strictly and return it; one that differs in any step that is left is lost."""
        session = read_session(path)
        result = replay_session(path, robot=self.robot, policy=self.policy, strict=True)
        if not result.identical or result.steps != session.steps - session.missing:
            raise StepsLost(f"does not replay: {result.verdict}")
        if result.total != session.steps:
            raise FalseReport(f"{session.steps} steps were recorded; the replay says {result.total}")
        return session

    def judge_ended_drive(self, path: Path, driven: int, *, loss: int) -> tuple[bool, int]:
        """Judge the recording of a drive that was ended; whether it is whole, and how many steps it lacks.

        Args:
            path: the recording.
            driven: control steps that were certainly done.
            loss: how many of them may be missing.
        """
        whole = examine_session(path).whole
        output = path
        if not whole:
            output = path.with_suffix(".repaired.rrd")
            repair_session(path, output)
            if not examine_session(output).whole:
                raise StepsLost("is not whole after its repair")
        session = self.require_replay(output)
        steps = session.steps - session.missing
        if steps < driven - loss:
            raise StepsLost(f"{driven} steps were driven, {steps} are there")
        return whole, max(0, driven - steps)


def list_recorded_steps(session: Session) -> NDArray[np.int64]:
    """Return the numbers of the control steps that a session has, which are all unless it was repaired."""
    numbers = np.arange(session.steps)
    for first, end in session.gaps:
        numbers = numbers[(numbers < first) | (numbers >= end)]
    return numbers
