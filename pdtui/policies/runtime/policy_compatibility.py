"""Whether a policy fits a world."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np

from pdtui.core.errors import PolicyError
from pdtui.policies.runtime.policy import Policy


def check_policy_fit(policy: Policy, world: gymnasium.Env[Any, Any], name: str) -> None:
    """Check that a policy takes a world's observations and gives its actions, by acting once on zeros.

    Raises:
        PolicyError: A shape differs; the message states those of the policy and of the robot called `name`.
    """
    observed = world.observation_space.shape or ()
    taken = policy.shape
    needed = world.action_space.shape or (1,)  # one number for a Discrete space
    gives = ""
    if taken == observed:
        state = policy.snapshot()
        given = policy.act(np.zeros(observed, np.float32)).action.shape
        policy.restore(state)
        if math.prod(given) == math.prod(needed):
            return
        gives = f" and gives actions of shape {given}"
    raise PolicyError(
        f"policy '{policy.name}' takes observations of shape {taken}{gives}; robot '{name}' has "
        f"observations of shape {observed} and actions of shape {needed}"
    )
