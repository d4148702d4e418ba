"""What one control step leaves behind, and what is known before the first."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdtui.policies.units import Stimulation
from pdtui.robots.types import NO_OBSTACLES, Attribute, Floats, Link
from pdtui.sessions.events import Event
from pdtui.sessions.schema import ActivationsKept
from pdtui.stimulation.latch import ActiveBehavior


@dataclass(frozen=True)
class DriveInfo:
    """What is known before the first control step: with the events, it determines the run.

    Attributes:
        robot: name of the robot.
        seed: of the first reset and of every random number.
        policy: name of the policy.
        policy_hash: SHA-256 of its weights.
        map_text: the map, whole.
        stochastic: whether actions are drawn from the policy's distribution instead of its mean.
        start: state in which episodes start, empty for the robot's usual one.
        dt: simulated time of a control step, s.
        attributes, links, layers: of robot and policy.
        activations: how they are recorded; no part of the run.
        obstacles: whether there are any where the first episode starts.
    """

    robot: str
    seed: int
    policy: str
    policy_hash: str
    map_text: str = field(repr=False)
    stochastic: bool
    dt: float
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]
    layers: tuple[int, ...]
    activations: ActivationsKept = "all"
    start: str = ""
    obstacles: bool = False


class StepRecord(NamedTuple):
    """One control step, after it happened.

    Attributes:
        step: number of the control step; the first is 0.
        episode: number of the episode; the first is 0.
        events: applied before this step.
        behaviors: active in this step.
        stimulation: units and the outputs that overwrote them.
        natural: what those units would have put out, in the same order.
        action: shape (A,).
        activations: every hidden unit, shape (U,), float32.
        attributes: after the step, shape (J,).
        poses: body poses after the step, shape (B, 7).
        reward, cost: of the step.
        digest: of the simulator's state after the step.
        ended: why the episode ended with this step, empty if it did not.
        diverged: whether the simulation cannot go on.
        finished: whether the robot's task is done, though it can go on.
        obstacles: in the robot's way, as `Robot.obstacles`, shape (N, 3): the same array in every step of a
            world, which is not recorded.
    """

    step: int
    episode: int
    events: tuple[Event, ...]
    behaviors: tuple[ActiveBehavior, ...]
    stimulation: Stimulation
    natural: tuple[float, ...]
    action: NDArray[np.float32]
    activations: NDArray[np.float32]
    attributes: Floats
    poses: Floats
    reward: float
    cost: float
    digest: int
    ended: str = ""
    diverged: bool = False
    finished: bool = False
    obstacles: Floats = NO_OBSTACLES
