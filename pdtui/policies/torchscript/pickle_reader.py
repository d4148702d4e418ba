"""Reads a pickle as data: nothing that it names is imported or called."""

from __future__ import annotations

import pickletools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import torch

from pdtui.core.errors import PolicyError

Storage = Callable[[str, str, int], torch.Tensor]
_VALUES = ("BINUNICODE", "SHORT_BINUNICODE", "BININT", "BININT1", "BININT2", "LONG1", "LONG4", "BINFLOAT")
_CONSTANTS = {"NEWTRUE": True, "NEWFALSE": False, "NONE": None}
_EMPTY: dict[str, Callable[[], Any]] = {"EMPTY_TUPLE": tuple, "EMPTY_LIST": list, "EMPTY_DICT": dict}
_LISTS = ("build_intlist", "build_doublelist", "build_boollist", "build_tensorlist")
_MARK = object()


@dataclass(frozen=True)
class PickledName:
    """The name of a class or function in the pickle, which is never imported."""

    text: str


@dataclass
class PickledObject:
    """An object of a class that the archive defines, as the class's name and the object's attributes."""

    kind: str
    attributes: dict[str, Any] = field(default_factory=dict)


def read_pickle(content: bytes, storage: Storage, source: str) -> Any:
    """Return the tree of objects, with its tensors.

    Args:
        content: The pickle.
        storage: Returns the numbers of a storage as a flat tensor, by key, kind and count.
        source: Name of the file, for messages.

    Raises:
        PolicyError: The pickle is damaged, or needs more than a TorchScript archive does.
    """
    stack: list[Any] = []
    memo: dict[int, Any] = {}
    try:
        for opcode, argument, _ in pickletools.genops(content):
            if opcode.name == "STOP":
                return stack.pop()
            _run_opcode(opcode.name, argument, stack, memo, storage)
    except PolicyError as error:
        raise PolicyError(f"{source}: {error}") from error
    except (ValueError, IndexError, KeyError, TypeError, AttributeError, RuntimeError) as error:
        raise PolicyError(f"{source}: damaged: {str(error)[:160] or type(error).__name__}") from error
    raise PolicyError(f"{source}: damaged: it does not end")


def _run_opcode(  # noqa: PLR0912 - one case per opcode
    name: str, argument: Any, stack: list[Any], memo: dict[int, Any], storage: Storage
) -> None:
    match name:
        case _ if name in _VALUES:
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
            if not isinstance(stack[-1], PickledObject) or not isinstance(state, dict):
                raise PolicyError("expected the attributes of a module by their names")
            stack[-1].attributes.update(state)
        case "REDUCE":
            arguments = stack.pop()
            stack.append(_call_named(stack.pop(), arguments))
        case _:
            raise PolicyError(f"holds pickle's '{name}', which no TorchScript archive needs")


def _since_mark(stack: list[Any]) -> list[Any]:
    values: list[Any] = []
    while (value := stack.pop()) is not _MARK:
        values.append(value)
    return values[::-1]


def _call_named(called: Any, arguments: tuple[Any, ...]) -> Any:
    name = called.text if isinstance(called, PickledName) else "an object"
    if name == "torch._utils._rebuild_tensor_v2":
        flat, offset, shape, stride = arguments[:4]
        last = offset + sum((size - 1) * step for size, step in zip(shape, stride, strict=True))
        if min((offset, *shape, *stride)) < 0 or (0 not in shape and last >= flat.numel()):
            raise PolicyError(f"a tensor of shape {tuple(shape)} does not fit its {flat.numel()} numbers")
        return flat.as_strided(shape, stride, offset).clone()
    if name == "collections.OrderedDict" and not arguments:
        return {}
    if name.rpartition(".")[2] in _LISTS and name.startswith("torch.jit._pickle."):
        return list(arguments[0])
    if name == "torch.jit._pickle.restore_type_tag":
        return arguments[0]
    raise PolicyError(f"would call {name[:100]}, which pdtui does not do for a file")
