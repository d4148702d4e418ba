"""Does a policy fit a world? Asked where the two meet, also of one that came from no file."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from pdtui.core.errors import PolicyError
from pdtui.policies.runtime.policy import Policy


def check_fit(policy: Policy, world: gymnasium.Env[Any, Any], name: str) -> None:
    """See that a policy takes what a world shows, and gives what it takes.

    Args:
        policy: acts once, on an observation of zeros; its hidden state stays.
        world: the robot; only its spaces are looked at.
        name: of the robot, for the message.

    Raises:
        PolicyError: a shape differs; the message has the policy's and the robot's.
    """
    observed = world.observation_space.shape or ()
    taken = policy.shape
    needed = _action_shape(world.action_space)
    given: tuple[int, ...] | None = None
    if taken == observed:
        state = policy.snapshot()
        given = policy.act(np.zeros(observed, np.float32)).action.shape
        policy.restore(state)
    if taken != observed or (given is not None and math.prod(given) != math.prod(needed)):
        gives = "" if given is None else f" and gives actions of shape {given}"
        raise PolicyError(
            f"policy '{policy.name}' takes observations of shape {taken}{gives}; robot '{name}' has "
            f"observations of shape {observed} and actions of shape {needed}"
        )


def _action_shape(space: spaces.Space[Any]) -> tuple[int, ...]:
    """Of the vector that a policy gives: one number for a Discrete space."""
    return space.shape or (1,)
