"""One episode in the forest and its score, whoever drives: nobody, a program, or a person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.headless_drive import events_of_pressed_keys, run_episode
from pdtui.paper.forest.key_motion_model import ObservedDrive
from pdtui.paper.forest.key_pressers import KeyPresser
from pdtui.paper.forest.scripted_operator import operator_keys
from pdtui.paper.scored_session import read_attribute, read_scored_session, record_scored_drive
from pdtui.robots.legged.terrain import AHEAD
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.writer.session_recorder import SessionRecorder

FOREST, ROUGH = "forest", "rough"
_STEPS_BEFORE_KEYS = 60
_STEPS_HELD = (30, 110)
"""Shortest and longest time for which a random key is held, control steps: 0.5 s to 1.8 s."""


@dataclass(frozen=True)
class ForestEpisodeScore:
    """The score of one episode.

    Attributes:
        distance: distance along x, m.
        collisions: number of trees that the robot ran into.
        outcome: whether it arrived at the far end of the forest, fell, or ran out of time.
        keys: the keys pressed, in their order.
        pressed_steps: number of control steps before which a key was pressed.
    """

    seed: int
    reward: float
    distance: float
    collisions: float
    outcome: Outcome
    steps: int
    keys: tuple[str, ...]
    pressed_steps: int

    @property
    def presses(self) -> int:
        """Number of key presses."""
        return len(self.keys)


def drive_forest_episode(
    loop: ControlLoop, steps: int, presser: KeyPresser | None = None, recorder: SessionRecorder | None = None
) -> tuple[ForestEpisodeScore, tuple[DriveEvent, ...]]:
    """Drive one episode, up to a fall, the far end of the forest, or the last step; return score and events.

    The drive is before its first step. Without a presser no key is pressed; the caller closes the recorder.
    """
    column = loop.robot.attribute_index("distance")

    def press(step: int) -> list[DriveEvent]:
        key = presser.press(step) if presser is not None else ""
        return events_of_pressed_keys([key] if key else [], loop)

    rewards, costs, distances = [], [], []
    events: list[DriveEvent] = []
    for record in run_episode(loop, steps, press):
        if recorder is not None:
            recorder.write(record)
        rewards.append(record.reward)
        costs.append(record.cost)
        distances.append(float(record.attributes[column]))
        events += record.events
        if distances[-1] >= AHEAD:
            break
    return _score(loop.seed, rewards, costs, distances, events, record.outcome), tuple(events)


def record_forest_episode(
    loop: ControlLoop, steps: int, presser: KeyPresser, path: Path, activations: ActivationsKept
) -> ForestEpisodeScore:
    """Run `drive_forest_episode` and record it like a person's drive, with a keystroke file beside it.

    Raises:
        SessionError: the session already exists, or cannot be written.
    """

    def drive(recorder: SessionRecorder) -> tuple[ForestEpisodeScore, tuple[DriveEvent, ...]]:
        return drive_forest_episode(loop, steps, presser, recorder)

    return record_scored_drive(loop, path, activations, drive)


def read_forest_episode(path: Path, robot: str, steps: int) -> tuple[ForestEpisodeScore, str]:
    """Score the first episode of a recorded drive, up to the same end, and return its policy's name, too.

    Raises:
        SessionError: the session cannot be read, is of another robot or start, or was rewound.
    """
    session = read_scored_session(path, robot, [FOREST], ["distance"])
    info = session.info
    distances = read_attribute(session, "distance")
    ends = [*np.flatnonzero(session.episodes != 0), *(np.flatnonzero(distances >= AHEAD) + 1), steps]
    count = int(min([session.steps, *ends]))
    run = _score(
        info.seed,
        session.rewards[:count].tolist(),
        session.costs[:count].tolist(),
        distances[:count].tolist(),
        [event for event in session.events if event.step < count],
        session.outcomes.get(count - 1),
    )
    return run, info.policy


def _score(
    seed: int,
    rewards: Sequence[float],
    costs: Sequence[float],
    distances: Sequence[float],
    events: Sequence[DriveEvent],
    ended: Outcome | None,
) -> ForestEpisodeScore:
    pressed = [event for event in events if event.key]
    return ForestEpisodeScore(
        seed,
        float(np.sum(rewards)),
        distances[-1],
        float(np.sum(costs)),
        ended or (Outcome.ARRIVED if distances[-1] >= AHEAD else Outcome.OUT_OF_TIME),
        len(rewards),
        tuple(event.key for event in pressed),
        len({event.step for event in pressed}),
    )


def drive_with_random_keys(loop: ControlLoop, steps: int) -> ObservedDrive:
    """Press the operator's keys in random order, drawn with the drive's seed, to observe what they do."""
    keys = list(operator_keys(loop.map).values())
    rng = np.random.default_rng(loop.seed)
    yaw = loop.robot.attribute_index("yaw")

    def read_place() -> list[float]:
        return [*loop.robot.read_poses()[0, :2].tolist(), float(loop.attributes[yaw])]

    places, choices, latched, until = [read_place()], [], 0, _STEPS_BEFORE_KEYS
    upcoming: list[int] = []
    for step in range(steps):
        pressed = step == until
        if pressed:
            upcoming = upcoming or [int(one) for one in rng.permutation(len(keys)) if one != latched]
            latched = upcoming.pop(0)
            until = step + int(rng.integers(*_STEPS_HELD))
        record = loop.advance(events_of_pressed_keys([keys[latched]] if pressed else [], loop))
        places.append(read_place())
        choices.append(latched)
        if record.ended:
            return ObservedDrive(np.array(places), np.array(choices), record.outcome)
    return ObservedDrive(np.array(places), np.array(choices), None)
