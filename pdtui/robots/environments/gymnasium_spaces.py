"""Conversions between a policy's vectors of floats and the spaces of Gymnasium's environments."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pdtui.core.errors import RobotError

_ACTION_SPACES = (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)


def flatten_observation_space(space: spaces.Space[Any], owner: str) -> spaces.Box:
    """Return the space that a policy sees: a Box as it is, everything else flattened.

    Raises:
        RobotError: The space does not flatten to a fixed count of numbers; the message names `owner`.
    """
    if isinstance(space, spaces.Box):
        return space
    flat = spaces.flatten_space(space) if space.is_np_flattenable else None
    if not isinstance(flat, spaces.Box):
        raise RobotError(f"{owner}: expected observations that flatten to numbers, found {space}")
    return flat


def check_action_space(space: spaces.Space[Any], owner: str) -> Any:
    """Return the space if a policy's vector can be an action of it.

    Raises:
        RobotError: It cannot; the message names `owner`.
    """
    if not isinstance(space, _ACTION_SPACES):
        names = ", ".join(kind.__name__ for kind in _ACTION_SPACES)
        raise RobotError(f"{owner}: expected actions of one of {names}, found {space}")
    return space


def vector_to_action(space: spaces.Space[Any], vector: NDArray[Any], owner: str) -> Any:
    """Return the environment's action for a policy's vector, shape (A,).

    A policy's integers count from 0, wherever the space's own count starts. Discrete takes one number.

    Raises:
        RobotError: The action is not one of the space's; the message names `owner`.
    """
    size = math.prod(space.shape or ())
    if vector.size != size:
        raise RobotError(f"{owner}: expected an action of {size} numbers, got {vector.size}")
    if isinstance(space, spaces.Box):
        return vector.reshape(space.shape).astype(space.dtype)
    whole = np.rint(vector).astype(np.int64).reshape(space.shape or ())
    chosen: Any = whole + getattr(space, "start", 0)
    chosen = np.int64(chosen) if isinstance(space, spaces.Discrete) else chosen.astype(space.dtype)
    if not space.contains(chosen):
        raise RobotError(f"{owner}: expected an action of {space}, got {whole.tolist()}")
    return chosen


def action_to_vector(space: spaces.Space[Any], action: Any) -> NDArray[np.float32]:
    """Return a policy's vector for an environment's action; the inverse of `vector_to_action`."""
    start = 0 if isinstance(space, spaces.Box) else getattr(space, "start", 0)
    vector: NDArray[np.float32] = (np.asarray(action) - start).astype(np.float32).reshape(-1)
    return vector


def to_number(value: Any) -> float | None:
    """Return a value as a number, or None if it is not one."""
    scalar = isinstance(value, bool | int | float | np.bool_ | np.number)
    array = isinstance(value, np.ndarray) and value.shape == () and value.dtype.kind in "bifu"
    return float(value) if scalar or array else None


def numeric_entries(info: Mapping[str, Any]) -> dict[str, float]:
    """Return those entries of an environment's info that are numbers."""
    found = {name: to_number(value) for name, value in info.items() if isinstance(name, str)}
    return {name: value for name, value in found.items() if value is not None}
