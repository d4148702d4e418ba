"""From a network's output to an action."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray

Decoder = Callable[[torch.Tensor, np.random.Generator | None], NDArray[np.float32]]


def mean_action(output: torch.Tensor, rng: np.random.Generator | None) -> NDArray[np.float32]:
    """The network's output is the action."""
    del rng
    action: NDArray[np.float32] = output.reshape(-1).numpy().astype(np.float32)
    return action


def categorical(output: torch.Tensor, rng: np.random.Generator | None) -> NDArray[np.float32]:
    """The network's output are the logits of discrete actions; the action is an index, shape (1,).

    Without a generator the likeliest action is taken (the first of equals), with one it is drawn from the
    softmax of the logits.
    """
    logits = output.reshape(-1).numpy().astype(np.float64)
    if rng is None:
        return np.array([np.argmax(logits)], np.float32)
    shares = np.cumsum(np.exp(logits - logits.max()))
    index = np.searchsorted(shares, rng.random() * shares[-1], side="right")
    return np.array([min(int(index), logits.size - 1)], np.float32)
