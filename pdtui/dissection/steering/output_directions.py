"""Directions of the last hidden layer that move chosen outputs of the network and leave the others alone.

An imprint can only make a policy do what it would do for some observation. Such a direction goes with it
where the posture that is wanted is one that the policy would correct.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from torch import nn

from pdtui.core.attributes import Floats
from pdtui.core.errors import PolicyError
from pdtui.policies.runtime.policy import Policy


def find_output_direction(policy: Policy, changes: Mapping[int, float], outputs: int) -> Floats:
    """Return the shortest change of the last hidden layer that changes the network's output by this much.

    It is W⁺δ with the pseudoinverse of the output layer's weights W, of which the rows of the first `outputs`
    count. What the network puts out is then decoded, so that a squashed action moves by less.

    Args:
        policy: The policy; its output layer is linear.
        changes: Changes by the index of the output, in units of the network's output.
        outputs: How many outputs count, from the first on: one per action, without deviations.

    Returns:
        The change, shape (n,) for a last layer of n units.

    Raises:
        PolicyError: The last linear layer does not read the last hidden layer, or has too few outputs.
    """
    linear = [one for one in policy.module.modules() if isinstance(one, nn.Linear)]
    width = policy.layers[-1]
    if not linear or linear[-1].in_features != width or linear[-1].out_features < outputs:
        raise PolicyError(
            f"{policy.name}: expected a linear layer at its end, from {width} units to {outputs} outputs"
        )
    wanted = np.zeros(outputs)
    for index, change in changes.items():
        if not 0 <= index < outputs:
            raise PolicyError(f"{policy.name}: expected an index of outputs below {outputs}, found {index}")
        wanted[index] = change
    weights = linear[-1].weight.detach().numpy()[:outputs].astype(np.float64)
    direction: Floats = np.linalg.pinv(weights) @ wanted
    return direction
