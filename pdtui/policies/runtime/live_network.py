"""A policy from a network that is held in memory."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import torch
from gymnasium import spaces
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.policies.runtime.action_decoders import Decoder, categorical, mean_action
from pdtui.policies.runtime.policy import Policy


def hash_network(module: nn.Module) -> str:
    """SHA-256 of a network's structure (as it prints itself) and of its weights and buffers, hexadecimal."""
    digest = hashlib.sha256(str(module).encode())
    for name, tensor in sorted(module.state_dict().items()):
        array = tensor.detach().cpu().contiguous()
        digest.update(f"{name} {array.dtype} {tuple(array.shape)}".encode())
        digest.update(array.view(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()


def policy_from_network(
    module: nn.Module,
    observation_space: spaces.Space[Any] | None = None,
    action_space: spaces.Space[Any] | None = None,
    *,
    observations: int | Sequence[int] | None = None,
    hidden: Sequence[str] | None = None,
    decode: Decoder | None = None,
    batched: bool = False,
    initial_state: Any = None,
    name: str = "",
    sha256: str = "",
) -> Policy:
    """A policy that acts with the network as it is now; later changes of the weights do not reach it.

    Args:
        module: the network, on the CPU; what it has to be like is said at `Policy`.
        observation_space: of the world, for the shape of the observation.
        action_space: of the world: where it is discrete, the network's output are the logits of the choices,
            else the output is the action.
        observations: length or shape of the observation, instead of the world's.
        hidden, batched, initial_state: as for `Policy`.
        decode: turns the output into an action, instead of what the action space says.
        name: for messages and maps; by default that of the module's class.
        sha256: of the file that it came from; by default `hash_network`.

    Raises:
        PolicyError: the shape of the observation is not known, or as for `Policy`.
    """
    shape = observations if observations is not None else getattr(observation_space, "shape", None)
    owner = name or type(module).__name__
    if shape is None:
        raise PolicyError(f"{owner}: expected the shape of the observation, or the robot that gives it")
    if decode is None:
        decode = categorical if isinstance(action_space, spaces.Discrete) else mean_action
    return Policy(
        module,
        shape,
        hidden=hidden,
        decode=decode,
        batched=batched,
        initial_state=initial_state,
        name=owner,
        sha256=sha256 or hash_network(module),
    )
