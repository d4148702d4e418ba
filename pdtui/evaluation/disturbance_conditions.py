"""The conditions of an evaluation: the robot's own world, and worlds disturbed in one way each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.units import Stimulation
from pdtui.driving.control_loop import PolicyAct
from pdtui.evaluation.protocol_settings import RandomPurpose, purpose_generator
from pdtui.policies.runtime.policy import PolicyStep
from pdtui.robots.robot import Robot

PUSH_SECONDS = (1.0, 3.0)
"""Shortest and longest time between two pushes, s; ANYmal's training pushes every 8 s."""
SPREAD_STEPS = 25
"""Control steps at the start in which the actions are random, where starts are spread."""


@dataclass(frozen=True)
class DisturbanceCondition:
    """A way to disturb a run.

    Attributes:
        name: Name in tables.
        says: What is done, in words.
        push: Largest change of each horizontal velocity of the trunk by a push, m/s; 0 for no pushes.
        friction, mass: Factors on the friction of all surfaces, and on all masses and inertias.
        noise: Standard deviation of the noise on each observation, as a share of the standard deviation that
            the observation has in an undisturbed walk.
        spread: Largest random part of the first actions, as a share of half the range of actions.
    """

    name: str
    says: str
    push: float = 0.0
    friction: float = 1.0
    mass: float = 1.0
    noise: float = 0.0
    spread: float = 0.0

    def is_offered(self, robot: Robot) -> bool:
        """Return whether a robot can be disturbed in this way."""
        scaled = self.friction != 1.0 or self.mass != 1.0
        bounded = bool(np.isfinite(_half_range(robot)).all())
        return (
            (not self.push or robot.offers_pushes)
            and (not scaled or robot.offers_scaled_physics)
            and (not self.spread or bounded)
        )


UNDISTURBED = DisturbanceCondition("undisturbed", "the robot's own world")
CONDITIONS = (
    UNDISTURBED,
    DisturbanceCondition(
        "pushed", "up to ±0.8 m/s every 1 to 3 s, as large as in ANYmal's training", push=0.8
    ),
    DisturbanceCondition("pushed hard", "twice as strongly", push=1.6),
    DisturbanceCondition("friction −20 %", "all surfaces", friction=0.8),
    DisturbanceCondition("friction +20 %", "all surfaces", friction=1.2),
    DisturbanceCondition("mass −20 %", "all bodies", mass=0.8),
    DisturbanceCondition("mass +20 %", "all bodies", mass=1.2),
    DisturbanceCondition("noisy sensors", "10 % of each observation's standard deviation", noise=0.1),
    DisturbanceCondition("spread starts", "the first 25 actions half random", spread=0.5),
)
"""Every condition, the undisturbed one first."""


def find_condition(name: str) -> DisturbanceCondition:
    """Return the condition of a name."""
    return next(condition for condition in CONDITIONS if condition.name == name)


@contextmanager
def disturbed_world(robot: Robot, condition: DisturbanceCondition) -> Iterator[None]:
    """Give the robot the condition's friction and masses while the block runs; begin it before the reset."""
    scaled = condition.friction != 1.0 or condition.mass != 1.0
    with robot.scaled_physics(condition.friction, condition.mass) if scaled else nullcontext():
        yield


def disturb_policy(
    act: PolicyAct, robot: Robot, condition: DisturbanceCondition, seed: int, observation_spread: Floats
) -> PolicyAct:
    """Return what acts in a condition's place: with noisy observations, or with half random first actions.

    Args:
        act: What acts undisturbed.
        robot: The robot, whose range of actions bounds the random ones.
        condition: The condition.
        seed: Seed of the run.
        observation_spread: Standard deviation of every observation in an undisturbed walk.
    """
    if condition.noise:
        noise = purpose_generator(RandomPurpose.SENSOR_NOISE, seed)
        scale = condition.noise * observation_spread

        def act_on_noise(
            observation: NDArray[Any], stimulation: Stimulation, rng: np.random.Generator | None
        ) -> PolicyStep:
            return act(observation + scale * noise.normal(size=observation.shape), stimulation, rng)

        return act_on_noise
    if condition.spread:
        starts = purpose_generator(RandomPurpose.START, seed)
        half, left = condition.spread * _half_range(robot), [SPREAD_STEPS]

        def act_at_random_first(
            observation: NDArray[Any], stimulation: Stimulation, rng: np.random.Generator | None
        ) -> PolicyStep:
            acted = act(observation, stimulation, rng)
            if left[0] == 0:
                return acted
            left[0] -= 1
            return shift_action(acted, robot, starts.uniform(-half, half))

        return act_at_random_first
    return act


def plan_pushes(
    condition: DisturbanceCondition, seed: int, dt: float, steps: int
) -> dict[int, tuple[float, float]]:
    """Return the pushes of a run, changes of vx and vy, by the control step before which they come."""
    if not condition.push:
        return {}
    rng = purpose_generator(RandomPurpose.PUSHES, seed)
    pushes, step = {}, 0
    while (step := step + max(1, round(rng.uniform(*PUSH_SECONDS) / dt))) < steps:
        vx, vy = rng.uniform(-condition.push, condition.push, 2).tolist()
        pushes[step] = (vx, vy)
    return pushes


def push_robot(robot: Robot, pushes: dict[int, tuple[float, float]], step: int) -> None:
    """Push the robot if it is time."""
    if step in pushes:
        robot.push_trunk(*pushes[step])


def shift_action(acted: PolicyStep, robot: Robot, shift: Floats) -> PolicyStep:
    """Return a policy's step with a shifted action, within the range of actions."""
    space: Any = robot.action_space
    shifted = np.clip(acted.action + shift, space.low, space.high).astype(np.float32)
    return acted._replace(action=shifted)


def _half_range(robot: Robot) -> Floats:
    space: Any = robot.action_space
    low, high = getattr(space, "low", np.array(-np.inf)), getattr(space, "high", np.array(np.inf))
    half: Floats = (np.asarray(high, np.float64) - np.asarray(low, np.float64)) / 2.0
    return half
