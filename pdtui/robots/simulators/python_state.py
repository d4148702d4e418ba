"""What Python objects remember, as plain data: copied, put back, and digested.

Plain are numbers, text, arrays, random generators, containers of those, and objects of importable classes
whose attributes are plain. Handles of libraries (a Box2D body, a window) are not: a copy of one is
no copy of its state.
"""

from __future__ import annotations

import copy
import enum
import sys
import types
from collections import deque
from hashlib import blake2b
from typing import Any, Protocol

import gymnasium
import numpy as np

Memory = dict[str, dict[str, Any]]
"""Attributes by name, for each layer of an environment by its number, the outermost first."""

_ATOMS = (type(None), bool, int, float, complex, str, bytes, enum.Enum, np.generic)
_SEQUENCES = (list, tuple, set, frozenset, deque)
_FIXED = (type, types.FunctionType, types.BuiltinFunctionType, types.MethodType, types.ModuleType)
_OWN_COPYING = ("__reduce__", "__reduce_ex__", "__getstate__", "__deepcopy__", "__slots__")
_FIXED_NAMES = {"env", "spec", "metadata", "observation_space", "action_space", "_cached_spec"}


class _Hash(Protocol):
    def update(self, data: bytes, /) -> None: ...


def layers_of(env: gymnasium.Env[Any, Any]) -> list[Any]:
    """The environment's wrappers from the outermost in, then the environment itself."""
    layers: list[Any] = [env]
    while isinstance(layers[-1], gymnasium.Wrapper):
        layers.append(layers[-1].env)
    return layers


def is_plain(value: Any, seen: frozenset[int] = frozenset()) -> bool:
    """Whether a copy of a value is a copy of everything that it remembers; a cycle is not."""
    if isinstance(value, _ATOMS) or type(value) is np.random.Generator:
        return True
    if isinstance(value, np.ndarray):
        return not value.dtype.hasobject
    if id(value) in seen:
        return False
    seen |= {id(value)}
    if isinstance(value, _SEQUENCES):
        return all(is_plain(item, seen) for item in value)
    if isinstance(value, dict):
        return all(is_plain(item, seen) for pair in value.items() for item in pair)
    return _is_simple(type(value)) and is_plain(vars(value), seen)


def _is_simple(kind: type) -> bool:
    """Whether objects of a class are their attributes and no more, and can travel to another process."""
    bases = kind.__mro__[:-1]
    if issubclass(kind, gymnasium.Env | gymnasium.Space) or not all(_is_python(base) for base in bases):
        return False
    if any(name in vars(base) for base in bases for name in _OWN_COPYING):
        return False
    found: Any = sys.modules.get(getattr(kind, "__module__", ""))
    for part in kind.__qualname__.split("."):
        found = getattr(found, part, None)
    return found is kind


def _is_python(kind: type) -> bool:
    """Whether a class was made by a class statement, not by an extension module."""
    heap_type = 1 << 9  # Py_TPFLAGS_HEAPTYPE
    return bool(kind.__flags__ & heap_type)


def unknown_parts(env: gymnasium.Env[Any, Any], ignored: tuple[type, ...] = ()) -> list[str]:
    """Names of attributes that are neither plain nor fixed: what is kept where no copy reaches."""
    return [
        f"{type(layer).__name__}.{name}"
        for layer in layers_of(env)
        for name, value in vars(layer).items()
        if not _is_fixed(name, value) and not isinstance(value, ignored) and not is_plain(value)
    ]


def remember(env: gymnasium.Env[Any, Any]) -> Memory:
    """A copy of every plain attribute of an environment and its wrappers."""
    # Copied together: what two attributes share, their copies share too.
    return copy.deepcopy({str(number): plain_of(layer) for number, layer in enumerate(layers_of(env))})


def recall(env: gymnasium.Env[Any, Any], memory: Memory) -> None:
    """Put remembered attributes back; plain ones that came since then go."""
    # A copy of the copy, or the next step would change what the snapshot holds.
    kept = copy.deepcopy(memory)
    for number, layer in enumerate(layers_of(env)):
        mine = kept.get(str(number), {})
        for name in plain_of(layer).keys() - mine.keys():
            delattr(layer, name)
        vars(layer).update(mine)


def plain_of(layer: Any) -> dict[str, Any]:
    """The plain attributes of one layer, by name."""
    return {
        name: value for name, value in vars(layer).items() if not _is_fixed(name, value) and is_plain(value)
    }


def digest_of(*parts: Any) -> int:
    """A 63-bit digest of plain values: equal values have equal digests."""
    hasher = blake2b(digest_size=8)
    for part in parts:
        _absorb(hasher, part)
    return int.from_bytes(hasher.digest(), "little") >> 1


def _is_fixed(name: str, value: Any) -> bool:
    """Whether an attribute is no state: part of the definition, or a view into a simulator's own memory."""
    if isinstance(value, np.ndarray):
        while isinstance(value, np.ndarray) and value.base is not None:
            value = value.base
        return not isinstance(value, np.ndarray | bytes)
    return name in _FIXED_NAMES or isinstance(value, (*_FIXED, gymnasium.Space))


def _absorb(hasher: _Hash, value: Any) -> None:
    hasher.update(type(value).__name__.encode())
    if isinstance(value, np.ndarray):
        hasher.update(f"{value.dtype.str}{value.shape}".encode())
        hasher.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, np.generic):
        hasher.update(value.tobytes())
    elif isinstance(value, _ATOMS):
        # repr tells floats apart to the last bit.
        hasher.update(f"{value!r};".encode())
    elif isinstance(value, np.random.Generator):
        _absorb(hasher, value.bit_generator.state)
    elif isinstance(value, set | frozenset):
        _absorb(hasher, sorted(digest_of(item) for item in value))
    elif isinstance(value, dict):
        _absorb(hasher, list(value.items()))
    elif isinstance(value, _SEQUENCES):
        hasher.update(f"{len(value)}:".encode())
        for item in value:
            _absorb(hasher, item)
    else:
        _absorb(hasher, vars(value))
