"""CleanRL state dicts, alone or as the first of several in one file.

PPO's actor is ``actor_mean.0 …`` with ``actor_logstd``, or ``actor.0 …`` with logits. SAC's is ``fc1``,
``fc2``, ``fc_mean`` and ``fc_logstd``; TD3's and DDPG's ends in ``fc_mu``. These three also hold
``action_scale`` and ``action_bias``.
"""

from __future__ import annotations

import re
from dataclasses import replace

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.partial_policy import (
    PartialPolicy,
    Tensors,
    check_layer_chain,
    join_mean_and_deviation,
    read_layer_sequence,
    read_linear_layer,
)

_FIRST = re.compile(r"(?:(0|actor)\.)?(?=(?:actor_mean|fc1)\.)")


def import_cleanrl(tensors: Tensors) -> PartialPolicy | None:
    """Return the actor of a CleanRL state dict; None if the tensors have other names."""
    prefixes = {match[0] for name in tensors if (match := _FIRST.match(name))}
    prefix = min(prefixes, key=len, default="")
    named = {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}
    if "actor_mean.0.weight" in named:
        layers = read_layer_sequence(named, "actor_mean")
        return PartialPolicy("CleanRL PPO", layers, log_std=named.get("actor_logstd"))
    if "actor.0.weight" in named and "critic.0.weight" in named:
        return PartialPolicy("CleanRL PPO", read_layer_sequence(named, "actor"), "categorical")
    last = next((name for name in ("fc_mean", "fc_mu") if f"{name}.weight" in named), None)
    if last is None or "fc1.weight" not in named:
        return None
    return _import_off_policy(named, last)


def _import_off_policy(named: Tensors, last: str) -> PartialPolicy:
    numbers = sorted(int(match[1]) for name in named if (match := re.fullmatch(r"fc(\d{1,4})\.weight", name)))
    hidden = [read_linear_layer(named, f"fc{number}") for number in numbers]
    if last == "fc_mu":
        layers = check_layer_chain([*hidden, read_linear_layer(named, last)], "fc")
        return PartialPolicy("CleanRL TD3 or DDPG", layers, "action", "", "tanh", *_action_bounds(named))
    head = join_mean_and_deviation(read_linear_layer(named, last), read_linear_layer(named, "fc_logstd"))
    layers = check_layer_chain([*hidden, head], "fc")
    policy = PartialPolicy("CleanRL SAC", layers, "gaussian pair", "", "tanh", *_action_bounds(named))
    return replace(policy, log_std_low=-5.0, log_std_high=2.0, log_std_rule="tanh")


def _action_bounds(named: Tensors) -> tuple[tuple[float, ...], tuple[float, ...]]:
    if "action_scale" not in named or "action_bias" not in named:
        return (), ()
    scale, bias = named["action_scale"].reshape(-1), named["action_bias"].reshape(-1)
    if scale.shape != bias.shape:
        expected = f"expected the shape {tuple(bias.shape)} of 'action_bias'"
        raise PolicyError(f"tensor 'action_scale': {expected}, found {tuple(scale.shape)}")
    return tuple((bias - scale).tolist()), tuple((bias + scale).tolist())
