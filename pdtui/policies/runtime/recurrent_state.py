"""States of recurrent networks: a tensor, or nested tuples and lists of tensors."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.core.errors import PolicyError

PolicyState = tuple[NDArray[Any], ...]
"""A saved recurrent state: its tensors in order; empty for a network without one."""


def flatten_recurrent_state(state: Any) -> Iterator[torch.Tensor]:
    """Yield the tensors of a recurrent state in order; anything else in it is a `PolicyError`."""
    if isinstance(state, torch.Tensor):
        yield state
    elif isinstance(state, tuple | list):
        for part in state:
            yield from flatten_recurrent_state(part)
    else:
        kind = type(state).__name__
        raise PolicyError(f"recurrent state: expected a tensor, or tuples of tensors, found {kind}")


def rebuild_recurrent_state(template: Any, tensors: Iterator[torch.Tensor]) -> Any:
    """Return the tensors, nested as in the template."""
    if isinstance(template, torch.Tensor):
        return next(tensors)
    parts = [rebuild_recurrent_state(part, tensors) for part in template]
    return tuple(parts) if isinstance(template, tuple) else parts


def clone_recurrent_state(state: Any) -> Any:
    """Return a copy that shares no memory."""
    return rebuild_recurrent_state(
        state, iter([tensor.detach().clone() for tensor in flatten_recurrent_state(state)])
    )


def recurrent_state_to_arrays(state: Any) -> PolicyState:
    """Return a copy as arrays, which can be sent between processes."""
    return tuple(np.array(tensor.detach().numpy()) for tensor in flatten_recurrent_state(state))


def state_shapes(state: Any) -> list[tuple[int, ...]]:
    """Return the shapes of the tensors of a recurrent state; none for None."""
    return [] if state is None else [tuple(tensor.shape) for tensor in flatten_recurrent_state(state)]


def check_recurrent_state(template: Any, state: Any) -> None:
    """Check that a state can be fed to the network again; `template` is its initial state, None for none."""
    expected, found = state_shapes(template), state_shapes(state)
    if expected != found:
        raise PolicyError(f"recurrent state: expected shapes {expected}, the network gave {found}")
