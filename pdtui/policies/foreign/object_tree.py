"""A tree of pickled objects as JSON and arrays, in which objects that are shared stay shared."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.pickle_reader import PickledName, PickledObject

_MAX_NODES = 100_000
"""Values in a tree: a hostile one could share a list so often that it has no end when it is written out."""
_MAX_OBJECTS = 5_000
"""Modules of a network."""


class _TreeEncoder:
    def __init__(self) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}
        self.objects: list[dict[str, Any]] = []
        self._numbers: dict[int, int] = {}
        self._kept: list[Any] = []  # so that no identity is given twice
        self._nodes = 0

    def encode(self, value: Any) -> Any:
        self._nodes += 1
        if self._nodes > _MAX_NODES:
            raise PolicyError(f"holds more than {_MAX_NODES} values")
        match value:
            case None | bool() | int() | float() | str():
                return value
            case list():
                return {"list": [self.encode(one) for one in value]}
            case tuple():
                return {"tuple": [self.encode(one) for one in value]}
            case dict():
                return {"dict": [[self.encode(key), self.encode(one)] for key, one in value.items()]}
            case PickledName():
                return {"name": value.text}
            case np.ndarray():
                number = self._number_of(value, len(self.arrays))
                # The order in memory is kept, since sums are rounded differently in another.
                order = sorted(range(value.ndim), key=lambda axis: -value.strides[axis])
                self.arrays[str(number)] = value.transpose(order)
                return {"array": number, "order": order}
            case PickledObject():
                number = self._number_of(value, len(self.objects))
                if number == len(self.objects):
                    if number >= _MAX_OBJECTS:
                        raise PolicyError(f"holds more than {_MAX_OBJECTS} modules")
                    self.objects.append({"kind": value.kind, "attributes": {}})
                    self.objects[number]["attributes"] = {
                        str(name): self.encode(one) for name, one in value.attributes.items()
                    }
                return {"object": number}
        raise PolicyError(f"holds {type(value).__name__}, expected numbers, text, tensors and modules")

    def _number_of(self, value: Any, new: int) -> int:
        self._kept.append(value)
        return self._numbers.setdefault(id(value), new)


def encode_tree(value: Any) -> tuple[Any, dict[str, NDArray[Any]]]:
    """Return a tree as JSON, and the arrays in it by the numbers that the JSON gives them."""
    encoder = _TreeEncoder()
    root = encoder.encode(value)
    return {"root": root, "objects": encoder.objects}, encoder.arrays


def decode_tree(tree: Any, tensors: dict[str, Any]) -> Any:
    """Return the tree that `encode_tree` took, with PyTorch's tensors in place of arrays."""
    objects = [PickledObject(one["kind"]) for one in tree["objects"]]
    placed: dict[int, Any] = {}

    def decode(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        if "array" in value:
            number = value["array"]
            if number not in placed:
                order = value["order"]
                placed[number] = tensors[str(number)].permute(
                    sorted(range(len(order)), key=order.__getitem__)
                )
            return placed[number]
        ((kind, content), *_) = value.items()
        match kind:
            case "list":
                return [decode(one) for one in content]
            case "tuple":
                return tuple(decode(one) for one in content)
            case "dict":
                return {decode(key): decode(one) for key, one in content}
            case "name":
                return PickledName(content)
        return objects[content]

    for made, one in zip(objects, tree["objects"], strict=True):
        made.attributes.update({name: decode(value) for name, value in one["attributes"].items()})
    return decode(tree["root"])
