"""Policies from networks in memory."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import torch
from gymnasium import spaces
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.policies.runtime.action_decoders import Decoder, decode_categorical_action, decode_mean_action
from pdtui.policies.runtime.policy import Policy


def hash_network(module: nn.Module) -> str:
    """Return the SHA-256 of a network's printed structure, weights and buffers, as hexadecimal digits."""
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
    batched: bool | None = None,
    initial_state: Any = None,
    name: str = "",
    sha256: str = "",
) -> Policy:
    """Return a policy that acts with a copy of the network as it is now.

    Args:
        module: The network, on the CPU; `Policy` says what it must be like.
        observation_space: The world's, which gives the shape of the observation.
        action_space: The world's. Where it is discrete, the network's output is taken as logits, otherwise as
            the action.
        observations: Length or shape of the observation, if there is no observation space.
        hidden, initial_state: As for `Policy`.
        batched: As for `Policy`; by default, a network that cannot take an observation alone is tried with a
            batch of one.
        decode: Turns the output into an action, instead of the action space's decoder.
        name: Name for messages and maps; by default that of the module's class.
        sha256: Hash of the file that the network came from; by default `hash_network`.

    Raises:
        PolicyError: The shape of the observation is unknown; or as for `Policy`.
    """
    shape = observations if observations is not None else getattr(observation_space, "shape", None)
    owner = name or type(module).__name__
    if shape is None:
        raise PolicyError(f"{owner}: expected the shape of the observation, or the robot that gives it")
    if decode is None:
        decode = (
            decode_categorical_action if isinstance(action_space, spaces.Discrete) else decode_mean_action
        )
    build = partial(
        Policy,
        module,
        shape,
        hidden=hidden,
        decode=decode,
        initial_state=initial_state,
        name=owner,
        sha256=sha256 or hash_network(module),
    )
    try:
        return build(batched=bool(batched))
    except PolicyError:
        if batched is not None:
            raise
        with suppress(PolicyError):
            return build(batched=True)
        raise
