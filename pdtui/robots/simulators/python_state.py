"""The state that Python objects hold, as plain data: copied, restored and digested.

Plain data are numbers, text, arrays, random generators, containers of those, and objects of importable
classes whose attributes are plain. Handles of libraries (a Box2D body, a window) are not: copying one does
not copy its state.
"""

from __future__ import annotations

import copy
import enum
import sys
import types
from collections import deque
from hashlib import blake2b
from typing import Any

import gymnasium
import numpy as np

PythonState = dict[str, dict[str, Any]]
"""Attributes by name, for each layer of an environment by its number, the outermost first."""

_ATOMS = (type(None), bool, int, float, complex, str, bytes, enum.Enum, np.generic)
_SEQUENCES = (list, tuple, set, frozenset, deque)
_FIXED = (type, types.FunctionType, types.BuiltinFunctionType, types.MethodType, types.ModuleType)
_OWN_COPYING = {"__reduce__", "__reduce_ex__", "__getstate__", "__deepcopy__", "__slots__"}
_HEAP_TYPE = 1 << 9  # Py_TPFLAGS_HEAPTYPE: made by a class statement, not by an extension module
_FIXED_NAMES = {"env", "spec", "metadata", "observation_space", "action_space", "_cached_spec"}


def wrapper_layers(env: gymnasium.Env[Any, Any]) -> list[Any]:
    """Return the environment's wrappers, the outermost first, then the environment itself."""
    layers: list[Any] = [env]
    while isinstance(layers[-1], gymnasium.Wrapper):
        layers.append(layers[-1].env)
    return layers


def is_plain_data(value: Any, seen: frozenset[int] = frozenset()) -> bool:
    """Return whether a copy of a value copies all of its state; that of a cycle does not."""
    if isinstance(value, _ATOMS) or type(value) is np.random.Generator:
        return True
    if isinstance(value, np.ndarray):
        return not value.dtype.hasobject
    if id(value) in seen:
        return False
    seen |= {id(value)}
    if isinstance(value, _SEQUENCES):
        return all(is_plain_data(item, seen) for item in value)
    if isinstance(value, dict):
        return all(is_plain_data(item, seen) for pair in value.items() for item in pair)
    # A handle of an extension module, such as that of an emulator, has no attributes of Python's.
    own = getattr(value, "__dict__", None)
    return isinstance(own, dict) and _is_simple(type(value)) and is_plain_data(own, seen)


def _is_simple(kind: type) -> bool:
    """Return whether objects of a class consist of their attributes, and can travel to another process."""
    bases = kind.__mro__[:-1]
    if issubclass(kind, gymnasium.Env | gymnasium.Space):
        return False
    if any(not base.__flags__ & _HEAP_TYPE or vars(base).keys() & _OWN_COPYING for base in bases):
        return False
    found: Any = sys.modules.get(getattr(kind, "__module__", ""))
    for part in kind.__qualname__.split("."):
        found = getattr(found, part, None)
    return found is kind


def has_uncopyable_attributes(env: gymnasium.Env[Any, Any], ignored: tuple[type, ...] = ()) -> bool:
    """Return whether some attribute is neither plain nor fixed, so that a copy misses its state."""
    attributes = (attribute for layer in wrapper_layers(env) for attribute in vars(layer).items())
    values = (value for name, value in attributes if not _is_fixed(name, value))
    return any(not isinstance(value, ignored) and not is_plain_data(value) for value in values)


def copy_python_state(env: gymnasium.Env[Any, Any]) -> PythonState:
    """Return a copy of every plain attribute of an environment and its wrappers."""
    # Copied together, so that copies share what two attributes share.
    layers = enumerate(wrapper_layers(env))
    return copy.deepcopy({str(number): plain_attributes(layer) for number, layer in layers})


def restore_python_state(env: gymnasium.Env[Any, Any], state: PythonState) -> None:
    """Put copied attributes back, and delete plain ones that were added since."""
    # Copy again, or the next step would change what the snapshot holds.
    kept = copy.deepcopy(state)
    for number, layer in enumerate(wrapper_layers(env)):
        mine = kept.get(str(number), {})
        for name in plain_attributes(layer).keys() - mine.keys():
            delattr(layer, name)
        vars(layer).update(mine)


def plain_attributes(layer: Any) -> dict[str, Any]:
    """Return the plain attributes of one layer by name."""
    state = {name: value for name, value in vars(layer).items() if not _is_fixed(name, value)}
    return {name: value for name, value in state.items() if is_plain_data(value)}


def digest_values(*parts: Any) -> int:
    """Return a 63-bit digest of plain values: equal values have equal digests."""
    hasher = blake2b(digest_size=8)
    for part in parts:
        _absorb(hasher, part)
    return int.from_bytes(hasher.digest(), "little") >> 1


def _is_fixed(name: str, value: Any) -> bool:
    """Return whether an attribute is no state, but a definition or a view into a simulator's memory."""
    if isinstance(value, np.ndarray):
        while isinstance(value, np.ndarray) and value.base is not None:
            value = value.base
        return not isinstance(value, np.ndarray | bytes)
    return name in _FIXED_NAMES or isinstance(value, (*_FIXED, gymnasium.Space))


def _absorb(hasher: blake2b, value: Any) -> None:
    hasher.update(type(value).__name__.encode())
    if isinstance(value, np.ndarray):
        hasher.update(f"{value.dtype.str}{value.shape}".encode())
        hasher.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, np.generic):
        hasher.update(value.tobytes())
    elif isinstance(value, _ATOMS):
        # repr distinguishes floats to the last bit.
        hasher.update(f"{value!r};".encode())
    elif isinstance(value, np.random.Generator):
        _absorb(hasher, value.bit_generator.state)
    elif isinstance(value, set | frozenset):
        _absorb(hasher, sorted(digest_values(item) for item in value))
    elif isinstance(value, dict):
        _absorb(hasher, list(value.items()))
    elif isinstance(value, _SEQUENCES):
        hasher.update(f"{len(value)}:".encode())
        for item in value:
            _absorb(hasher, item)
    else:
        _absorb(hasher, vars(value))
