"""Reads a pickle as data: nothing that it names is imported or called."""

from __future__ import annotations

import pickletools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import PolicyError

Storage = Callable[[str, str, int], NDArray[Any]]
MAX_PICKLE = 1 << 20
"""Bytes of a pickle, which holds only names and shapes: 1,000 tensors take about 100,000."""
_MAX_INTEGER = (1 << 63) - 1
_VALUES = (
    "BINUNICODE", "SHORT_BINUNICODE", "BININT", "BININT1", "BININT2", "LONG1", "BINFLOAT", "BINBYTES",
    "SHORT_BINBYTES",
)  # fmt: skip
_CONSTANTS = {"NEWTRUE": True, "NEWFALSE": False, "NONE": None}
_EMPTY: dict[str, Callable[[], Any]] = {"EMPTY_TUPLE": tuple, "EMPTY_LIST": list, "EMPTY_DICT": dict}
_LISTS = ("build_intlist", "build_doublelist", "build_boollist", "build_tensorlist")
_MARK = object()


class ForbiddenCallError(PolicyError):
    """A pickle would call something that pdtui does not call for a file."""


@dataclass(frozen=True)
class PickledName:
    """The name of a class, a function or a constant in the pickle, which is never imported."""

    text: str


@dataclass
class PickledObject:
    """An object of a class that the archive defines, as the class's name and the object's attributes."""

    kind: str
    attributes: dict[str, Any] = field(default_factory=dict)


def read_pickle(content: bytes, storage: Storage) -> Any:
    """Return the tree of objects, with its arrays, which may share memory.

    Args:
        content: The pickle.
        storage: Returns the numbers of a storage as a flat array, by key, kind and count.

    Raises:
        PolicyError: The pickle is damaged, or needs more than tensors, containers and TorchScript modules do.
    """
    stack: list[Any] = []
    memo: dict[int, Any] = {}
    try:
        for opcode, argument, _ in pickletools.genops(content):
            if opcode.name == "STOP":
                return stack.pop()
            _run_opcode(opcode.name, argument, stack, memo, storage)
    except (ValueError, IndexError, KeyError, TypeError, AttributeError, RuntimeError) as error:
        raise PolicyError(f"damaged: {str(error)[:160] or type(error).__name__}") from error
    raise PolicyError("damaged: it does not end")


def _run_opcode(  # noqa: PLR0912, PLR0915 - one case per opcode
    name: str, argument: Any, stack: list[Any], memo: dict[int, Any], storage: Storage
) -> None:
    match name:
        case _ if name in _VALUES:
            if isinstance(argument, int) and abs(argument) > _MAX_INTEGER:
                raise PolicyError("holds an integer of more than 64 bits")
            stack.append(argument)
        case _ if name in _CONSTANTS:
            stack.append(_CONSTANTS[name])
        case "PROTO" | "FRAME":
            pass
        case "BINPUT" | "LONG_BINPUT":
            memo[argument] = stack[-1]
        case "BINGET" | "LONG_BINGET":
            stack.append(memo[argument])
        case "GLOBAL":
            stack.append(PickledName(argument.replace(" ", ".")))
        case "BINPERSID":
            _, kind, key, _, count = stack.pop()
            stack.append(storage(str(key), kind.text, int(count)))
        case "MARK":
            stack.append(_MARK)
        case _ if name in _EMPTY:
            stack.append(_EMPTY[name]())
        case "TUPLE":
            stack.append(tuple(_since_mark(stack)))
        case "TUPLE1" | "TUPLE2" | "TUPLE3":
            count = int(name[-1])
            stack[-count:] = [tuple(stack[-count:])]
        case "APPEND":
            value = stack.pop()
            stack[-1].append(value)
        case "APPENDS":
            values = _since_mark(stack)
            stack[-1].extend(values)
        case "SETITEM":
            pair = stack.pop(-2), stack.pop()
            stack[-1].update([pair])
        case "SETITEMS":
            flat = _since_mark(stack)
            stack[-1].update(zip(flat[::2], flat[1::2], strict=True))
        case "NEWOBJ":
            stack.pop()
            stack.append(PickledObject(stack.pop().text))
        case "BUILD":
            state = stack.pop()
            if isinstance(stack[-1], PickledObject) and isinstance(state, dict):
                stack[-1].attributes.update(state)
            elif isinstance(stack[-1], PickledObject) or not isinstance(stack[-1], dict):
                # A dictionary's own attributes, such as _metadata of a state dict, are of no use.
                raise PolicyError("expected the attributes of a module by their names")
        case "REDUCE":
            arguments = stack.pop()
            stack.append(_call_named(stack.pop(), arguments))
        case _:
            raise PolicyError(f"holds pickle's '{name}', which no such file needs")


def _since_mark(stack: list[Any]) -> list[Any]:
    values: list[Any] = []
    while (value := stack.pop()) is not _MARK:
        values.append(value)
    return values[::-1]


def _call_named(called: Any, arguments: tuple[Any, ...]) -> Any:
    name = called.text if isinstance(called, PickledName) else "an object"
    if name == "torch._utils._rebuild_tensor_v2":
        return _rebuild_array(*arguments[:4])
    if name == "torch._utils._rebuild_parameter":
        return arguments[0]
    if name == "collections.OrderedDict" and not arguments:
        return {}
    if name in ("torch.Size", "__builtin__.set", "builtins.set"):
        return tuple(arguments[0])
    if name == "torch.device":
        return PickledName(f"torch.device.{str(arguments[0])[:20]}")
    if name.rpartition(".")[2] in _LISTS and name.startswith("torch.jit._pickle."):
        return list(arguments[0])
    if name == "torch.jit._pickle.restore_type_tag":
        return arguments[0]
    raise ForbiddenCallError(f"would call {name[:100]}, which pdtui does not do for a file")


def _rebuild_array(flat: Any, offset: int, shape: Any, stride: Any) -> NDArray[Any]:
    """Return a tensor as a view of its storage, which holds every number that the shape claims."""
    sizes = (offset, *shape, *stride)
    if not isinstance(flat, np.ndarray) or not all(type(size) is int for size in sizes) or min(sizes) < 0:
        raise PolicyError("damaged: a tensor without numbers, or of a negative size")
    last, numbers = offset, 1
    for size, step in zip(shape, stride, strict=True):
        last, numbers = last + (size - 1) * step, numbers * size
    if numbers > flat.size:
        raise PolicyError(f"a tensor of shape {tuple(shape)} claims more numbers than are stored")
    if numbers and last >= flat.size:
        raise PolicyError(f"a tensor of shape {tuple(shape)} does not fit its {flat.size} numbers")
    if not numbers:
        return np.empty(_check_shape(shape), flat.dtype)
    steps = [step * flat.itemsize for step in stride]
    return np.lib.stride_tricks.as_strided(flat[offset:], shape, steps, writeable=False)


def _check_shape(shape: Any) -> tuple[int, ...]:
    """Return an empty array's shape; one that only NumPy would choke on is a `PolicyError`."""
    if len(shape) > 32 or max(shape) > _MAX_INTEGER >> 8:
        raise PolicyError(f"a tensor of shape {str(tuple(shape))[:80]} is not one that can be held")
    return tuple(shape)
