"""Between a policy's vector of floats and an environment's spaces."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pdtui.core.errors import RobotError

KNOWN = (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)


def flat_observations(space: spaces.Space[Any], owner: str) -> spaces.Box:
    """The space as a policy sees it: a Box as it is, everything else flattened.

    Raises:
        RobotError: the space does not flatten to numbers of a fixed count; the message names `owner`.
    """
    if isinstance(space, spaces.Box):
        return space
    flat = spaces.flatten_space(space) if space.is_np_flattenable else None
    if not isinstance(flat, spaces.Box):
        raise RobotError(f"{owner}: expected observations that flatten to numbers, found {space}")
    return flat


def known_actions(space: spaces.Space[Any], owner: str) -> Any:
    """The space, if a policy's vector can be an action of it.

    Raises:
        RobotError: it cannot; the message names `owner`.
    """
    if not isinstance(space, KNOWN):
        names = ", ".join(kind.__name__ for kind in KNOWN)
        raise RobotError(f"{owner}: expected actions of one of {names}, found {space}")
    return space


def action_size(space: spaces.Space[Any]) -> int:
    """How many numbers a policy gives for one action; 1 for Discrete: the number of the choice."""
    return math.prod(space.shape or ())


def action_for(space: spaces.Space[Any], action: NDArray[Any], owner: str) -> Any:
    """The environment's action from a policy's vector, shape (A,).

    Whole numbers count from 0, wherever the space's own count starts.

    Raises:
        RobotError: the action is not one of the space's; the message names `owner`.
    """
    if action.size != action_size(space):
        raise RobotError(f"{owner}: expected an action of {action_size(space)} numbers, got {action.size}")
    if isinstance(space, spaces.Box):
        return action.reshape(space.shape).astype(space.dtype)
    whole = np.rint(action).astype(np.int64).reshape(space.shape or ())
    chosen: Any = whole + getattr(space, "start", 0)
    chosen = np.int64(chosen) if isinstance(space, spaces.Discrete) else chosen.astype(space.dtype)
    if not space.contains(chosen):
        raise RobotError(f"{owner}: expected an action of {space}, got {whole.tolist()}")
    return chosen


def as_vector(space: spaces.Space[Any], action: Any) -> NDArray[np.float32]:
    """A policy's vector from an environment's action: the other way round."""
    start = 0 if isinstance(space, spaces.Box) else getattr(space, "start", 0)
    vector: NDArray[np.float32] = (np.asarray(action) - start).astype(np.float32).reshape(-1)
    return vector


def number_of(value: Any) -> float | None:
    """A value as a number; None if it is none."""
    if isinstance(value, bool | int | float | np.bool_ | np.number):
        return float(value)
    if isinstance(value, np.ndarray) and value.shape == () and value.dtype.kind in "bifu":
        return float(value)
    return None


def numbers_of(info: Mapping[str, Any]) -> dict[str, float]:
    """What an info holds of numbers, by name."""
    found = {name: number_of(value) for name, value in info.items() if isinstance(name, str)}
    return {name: value for name, value in found.items() if value is not None}
