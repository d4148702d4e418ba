"""From a weights file to a policy that can be driven."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.errors import PolicyError
from pdtui.policies.decoders import Decoder
from pdtui.policies.files import file_hash, find_weights, load_network
from pdtui.policies.network import NetworkSpec
from pdtui.policies.runtime import Policy


def decoder_for(spec: NetworkSpec) -> Decoder:
    """How this network's output becomes an action inside its bounds."""
    low = np.array(spec.action_low, np.float32)
    high = np.array(spec.action_high, np.float32)
    middle, half = (high + low) / 2, (high - low) / 2

    def squashed(output: torch.Tensor, rng: np.random.Generator | None) -> NDArray[np.float32]:
        numbers = output.numpy()
        mean = numbers[: spec.actions]
        if rng is not None:
            log_std = numbers[spec.actions :]
            mean = mean + np.exp(np.clip(log_std, -5.0, 2.0)) * rng.standard_normal(spec.actions, np.float32)
        action: NDArray[np.float32] = middle + half * np.tanh(mean)
        return action

    def clipped(output: torch.Tensor, rng: np.random.Generator | None) -> NDArray[np.float32]:
        if rng is not None:
            raise PolicyError("this policy has no action distribution; it acts with its mean only")
        action: NDArray[np.float32] = np.clip(output.numpy(), low, high)
        return action

    return squashed if spec.head == "squashed_gaussian" else clipped


def load_policy(name: str | Path, robot: str | None = None) -> Policy:
    """Load a weights file, or a shipped policy by its name.

    PyTorch is set to one thread: at this size more threads only cost, and sums keep their order.

    Raises:
        PolicyError: no such file, unreadable, or made for another robot.
    """
    path = find_weights(str(name))
    network = load_network(path)
    spec = network.spec
    if robot is not None and spec.robot != robot:
        raise PolicyError(f"{path}: expected a policy for robot '{robot}', found one for '{spec.robot}'")
    torch.set_num_threads(1)
    return Policy(
        network, spec.observations, decode=decoder_for(spec), name=path.stem, sha256=file_hash(path)
    )
