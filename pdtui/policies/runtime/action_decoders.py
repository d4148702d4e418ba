"""Decoders, which turn the output of a network into an action."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.core.errors import PolicyError
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork

_Floats = NDArray[np.float32]
Decoder = Callable[[torch.Tensor, np.random.Generator | None], _Floats]


def decode_mean_action(output: torch.Tensor, _rng: np.random.Generator | None) -> _Floats:
    """Take the network's output as the action."""
    action: _Floats = output.reshape(-1).numpy().astype(np.float32)
    return action


def decode_categorical_action(output: torch.Tensor, rng: np.random.Generator | None) -> _Floats:
    """Take the network's output as logits of discrete actions; the action is an index, shape (1,).

    Without a generator, the most likely action is taken, the first among equals; with one, it is drawn from
    the softmax of the logits.
    """
    logits = output.reshape(-1).numpy().astype(np.float64)
    if rng is None:
        return np.array([np.argmax(logits)], np.float32)
    shares = np.cumsum(np.exp(logits - logits.max()))
    index = np.searchsorted(shares, rng.random() * shares[-1], side="right")
    return np.array([min(int(index), logits.size - 1)], np.float32)


def make_action_decoder(network: PolicyNetwork) -> Decoder:
    """Return the decoder of a network: its actions are float32 and inside the bounds.

    Actions have the shape (actions,), or (1,) with an index where actions are discrete.
    """
    spec = network.spec
    if spec.head == "categorical":
        return decode_categorical_action
    fixed = network.log_std.numpy() if spec.gaussian and spec.log_std == "parameter" else None
    squash = spec.head in ("squashed_gaussian", "tanh")
    low, high = np.array(spec.action_low, np.float32), np.array(spec.action_high, np.float32)
    middle, half = (high + low) / 2, (high - low) / 2

    def decode(output: torch.Tensor, rng: np.random.Generator | None) -> _Floats:
        values: _Floats = output.numpy()
        mean = values[: spec.actions]
        if spec.mean_limit:
            mean = np.clip(mean, -spec.mean_limit, spec.mean_limit)
        if rng is not None:
            if not spec.gaussian:
                raise PolicyError("this policy has no action distribution; it acts with its mean only")
            std = np.exp(_log_std(spec, values[spec.actions :] if fixed is None else fixed))
            mean = (mean + std * rng.standard_normal(spec.actions, np.float32)).astype(np.float32, copy=False)
        if squash:
            return (middle + half * np.tanh(mean)).astype(np.float32, copy=False)
        return np.clip(mean, low, high) if low.size else mean.copy()

    return decode


def _log_std(spec: NetworkSpec, values: _Floats) -> _Floats:
    low, high = spec.log_std_low, spec.log_std_high
    if spec.log_std_rule == "tanh":
        return (low + 0.5 * (high - low) * (np.tanh(values) + 1)).astype(np.float32, copy=False)
    return np.clip(values, low, high)
