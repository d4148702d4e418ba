"""RLlib weights in an ``.npz``, named as in RLlib's TensorFlow policies.

Kernels have the shape (inputs, outputs). SAC's actor is ``…/action_1 … action_out``; it puts out a mean and a
log standard deviation, squashed by tanh. PPO's actor is ``…/fc_1 … fc_out``; it puts out such a pair, or
logits of discrete actions.
"""

from __future__ import annotations

import re
from dataclasses import replace

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.partial_policy import (
    LinearLayer,
    PartialPolicy,
    Tensors,
    check_layer_chain,
    read_linear_layer,
)

_SAC = re.compile(r"(.*?/?)(?:sequential/)?(action)_(\d{1,4}|out)/kernel")
_PPO = re.compile(r"(.*?/?)(fc)_(\d{1,4}|out)/kernel")


def import_rllib(tensors: Tensors) -> PartialPolicy | None:
    """Return the policy in RLlib's weights; None if the tensors have other names.

    A policy and its target network have the same layers; the first in the file is the policy.
    """
    if layers := _actor_layers(tensors, _SAC):
        policy = PartialPolicy("RLlib SAC", layers, "gaussian pair", squash="tanh")
        return replace(policy, log_std_low=-5.0, log_std_high=2.0)
    layers = _actor_layers(tensors, _PPO)
    return PartialPolicy("RLlib PPO", layers, "unknown pair") if layers else None


def _actor_layers(tensors: Tensors, pattern: re.Pattern[str]) -> tuple[LinearLayer, ...]:
    layers: dict[str, LinearLayer] = {}
    scope = None
    for name in tensors:
        if match := pattern.fullmatch(name):
            prefix = name.removesuffix("/kernel")
            here = prefix.rpartition("/")[0]
            scope = here if scope is None else scope
            if here == scope:
                layers[match[3]] = _read_transposed_layer(tensors, prefix)
    if "out" not in layers:
        return ()
    order = sorted((key for key in layers if key != "out"), key=int)
    return check_layer_chain([layers[key] for key in [*order, "out"]], scope or "")


def _read_transposed_layer(tensors: Tensors, prefix: str) -> LinearLayer:
    kernel, bias = tensors[f"{prefix}/kernel"], tensors.get(f"{prefix}/bias")
    if kernel.ndim != 2:
        raise PolicyError(
            f"tensor '{prefix}/kernel': expected shape (inputs, outputs), found {tuple(kernel.shape)}"
        )
    named = {"layer.weight": kernel.T.contiguous()} | ({} if bias is None else {"layer.bias": bias})
    return read_linear_layer(named, "layer")
