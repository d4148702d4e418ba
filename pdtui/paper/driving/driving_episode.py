"""One episode on the road and its score, whoever drives: the policy, a program, or a person."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pdtui.core.errors import SessionError
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.paper.driving.drive_operators import DriveOperator, SharedControl
from pdtui.paper.scored_session import read_scored_session
from pdtui.robots.road.road_scenes import TEST_SCENES
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.writer.session_recorder import SessionRecorder

TEST_STARTS = tuple(f"test-{number}" for number in range(TEST_SCENES))
"""The scenes of the experiment."""


@dataclass(frozen=True)
class DrivingScore:
    """The score of one episode.

    Attributes:
        scene: Name of the start.
        outcome: How it ended.
        reward: The paper's return.
        cost: Sum of the costs.
        steps: Number of control steps.
        involvement: Number of control steps in which a key was pressed or the operator steered.
        presses: Number of key presses.
    """

    scene: str
    outcome: Outcome
    reward: float
    cost: float
    steps: int
    involvement: int
    presses: int

    @property
    def success(self) -> bool:
        """Whether it reached the destination."""
        return self.outcome is Outcome.ARRIVED

    @property
    def out_of_road(self) -> bool:
        """Whether it ended off the road."""
        return self.outcome is Outcome.LEFT_ROAD


def drive_episode(
    loop: ControlLoop, operator: DriveOperator, watch: Callable[[StepRecord], None] = lambda _: None
) -> DrivingScore:
    """Drive one episode to its end and score it.

    Args:
        loop: The drive, before its first step.
        operator: Who operates it.
        watch: Called with the record of each step.
    """
    rewards, costs = [], []
    involvement = presses = 0
    traffic = loop.robot.read_traffic()
    for _ in range(loop.robot.episode_steps):
        record = loop.advance(operator.act(traffic))
        traffic = record.traffic
        watch(record)
        rewards.append(record.reward)
        costs.append(record.cost)
        involvement += record.involved
        presses += sum(bool(event.key) for event in record.events)
        if record.ended:
            break
    return DrivingScore(
        loop.start,
        record.outcome or Outcome.OUT_OF_TIME,
        float(np.sum(rewards)),
        float(np.sum(costs)),
        len(rewards),
        involvement,
        presses,
    )


def record_episode(
    loop: ControlLoop, operator: DriveOperator, path: Path, activations: ActivationsKept
) -> DrivingScore:
    """Run `drive_episode` and record it like a person's drive.

    Raises:
        SessionError: The session already exists, or cannot be written.
    """
    with SessionRecorder(path, replace(loop.info, activations=activations)) as recorder:
        return drive_episode(loop, operator, recorder.write)


def read_episode(path: Path, robot: str) -> tuple[DrivingScore, str, SharedControl]:
    """Score the first episode of a recorded drive, and return its policy's name and how control was shared.

    Raises:
        SessionError: The session cannot be read, is of another robot, does not start in a test scene, was
            rewound, or stops before the end of its episode.
    """
    session = read_scored_session(path, robot, TEST_STARTS)
    info = session.info
    count = int((session.episodes == 0).sum())
    outcome = session.outcomes.get(count - 1)
    if outcome is None:
        raise SessionError(
            f"{path}: its first episode stops at step {count} and has no outcome; drive on until it ends"
        )
    presses = [event.step for event in session.events if event.key and event.step < count]
    taken = {step for step in range(count) if session.replaced_actions[step]}
    score = DrivingScore(
        info.start,
        outcome,
        float(session.rewards[:count].sum()),
        float(session.costs[:count].sum()),
        count,
        len({*presses, *taken}),
        len(presses),
    )
    control: SharedControl = "takeover" if taken else "keys" if presses else "alone"
    return score, info.policy, "human only" if len(taken) == count else control
