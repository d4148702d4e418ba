"""Directions of the last hidden layer that move or set chosen outputs of the network.

An imprint can only make a policy do what it would do for some observation. Such a direction goes with it
where what is wanted is a posture that the policy would correct, or a motion that it knows nothing of.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
    weights, _ = _read_output_layer(policy, outputs)
    wanted = np.zeros(outputs)
    for index, change in changes.items():
        if not 0 <= index < outputs:
            raise PolicyError(f"{policy.name}: expected an index of outputs below {outputs}, found {index}")
        wanted[index] = change
    direction: Floats = np.linalg.pinv(weights) @ wanted
    return direction


def solve_coordinates_for_outputs(policy: Policy, values: Sequence[float]) -> tuple[Floats, Floats]:
    """Return where in the last hidden layer the network puts out these values.

    With W = RᵀUᵀ and orthonormal U, the outputs Wh + b are the wanted y where Uᵀh = R⁻ᵀ(y − b). An
    intervention of kind ``direction`` that sets these coordinates leaves the rest of the layer alone.

    Args:
        policy: The policy; its output layer is linear.
        values: Wanted values of the first outputs, before they are decoded.

    Returns:
        The vectors U, which depend on the policy and on the number of values only, shape (k, n), and the
        coordinates along them, shape (k,).

    Raises:
        PolicyError: As `find_output_direction`.
    """
    weights, bias = _read_output_layer(policy, len(values))
    vectors, triangle = np.linalg.qr(weights.T)
    coordinates: Floats = np.linalg.solve(triangle.T, np.array(values) - bias)
    return vectors.T, coordinates


def _read_output_layer(policy: Policy, outputs: int) -> tuple[Floats, Floats]:
    """Return the weights and the bias of the first outputs, shapes (outputs, n) and (outputs,)."""
    linear = [one for one in policy.module.modules() if isinstance(one, nn.Linear)]
    width = policy.layers[-1]
    if not linear or linear[-1].in_features != width or linear[-1].out_features < outputs:
        raise PolicyError(
            f"{policy.name}: expected a linear layer at its end, from {width} units to {outputs} outputs"
        )
    weights = linear[-1].weight.detach().numpy()[:outputs].astype(np.float64)
    if linear[-1].bias is None:
        return weights, np.zeros(outputs)
    return weights, linear[-1].bias.detach().numpy()[:outputs].astype(np.float64)
