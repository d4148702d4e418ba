"""What an operator will take, from the shapes of its arguments, before it is applied."""

from __future__ import annotations

import math
from typing import Any

import torch

from pdtui.policies.torchscript.forward_pass_budget import (
    MAX_ELEMENTS,
    OPERATOR_WORK,
    ForwardPassBudget,
    ForwardPassLimitError,
)

_LISTED = """
    zeros ones full arange scalar_tensor one_hot expand expand_as repeat unflatten
    conv1d conv2d conv3d _convolution max_pool1d max_pool2d avg_pool1d avg_pool2d adaptive_avg_pool2d
    adaptive_max_pool2d
"""
_RESIZING = frozenset(_LISTED.split())
"""Operators whose result may exceed the product of their tensors' sizes, since numbers choose its size."""
_PRODUCTS = {"linear": 0, "matmul": 0, "mm": 0, "bmm": 0, "mv": 0, "addmm": 1, "addmv": 1}
"""Products of matrices, and the place of the first factor among the arguments."""
_RECURRENT = (
    "lstm",
    "gru",
    "rnn_tanh",
    "rnn_relu",
    "lstm_cell",
    "gru_cell",
    "rnn_tanh_cell",
    "rnn_relu_cell",
)
_CONVOLUTIONS = ("conv1d", "conv2d", "conv3d", "_convolution")
_POOLS = ("max_pool1d", "max_pool2d", "avg_pool1d", "avg_pool2d")
_PARTING = ("unbind", "split", "chunk")
_MAX_PARTS = 4096
"""Tensors that an operator may return."""
_SMALL = 1 << 22
"""Elements of a result up to which an upper bound is enough."""


def check_operator_cost(
    name: str,
    arguments: list[Any],
    keywords: dict[str, Any],
    tensors: list[torch.Tensor],
    budget: ForwardPassBudget,
) -> None:
    """Count what an operator takes in the budget of the pass.

    One that takes too much is a `ForwardPassLimitError`.

    Args:
        name: Name of the operator.
        arguments, keywords: Its arguments.
        tensors: The tensors among the arguments.
        budget: The budget of the pass.
    """
    if name in _PARTING:
        _check_number_of_parts(name, arguments)
    bound = elements = _result_bound(name, tensors)
    # A recurrent layer computes even its shape step by step, so that its bound has to do.
    if name in _RESIZING or (bound > _SMALL and name not in _RECURRENT):
        elements = _result_elements(name, arguments, keywords)
    if elements > MAX_ELEMENTS:
        raise ForwardPassLimitError(
            f"torch.{name} would create {elements} elements, expected at most {MAX_ELEMENTS}"
        )
    work, held = _product_cost(name, arguments, tensors, elements)
    budget.check_memory(elements + held, max((one.itemsize for one in tensors), default=4))
    # An upper bound would count far too much in the end.
    expected = elements if name in _RESIZING or name in _PRODUCTS or bound > _SMALL else 0
    budget.count_work(work, expected, tensors)


def _sizes(tensor: torch.Tensor) -> int:
    """Return the product of a tensor's sizes, counting an empty one as 1, because a product may drop it."""
    return math.prod(max(1, size) for size in tensor.shape)


def _result_bound(name: str, tensors: list[torch.Tensor]) -> int:
    """Return an upper bound on the elements of a result whose size depends on no numeric argument."""
    if name in _PRODUCTS and len(tensors) >= 2:
        first, second = tensors[_PRODUCTS[name] : _PRODUCTS[name] + 2]
        inner = _inner_size(first)
        return _sizes(first) // inner * (_sizes(second) // inner)
    if name in _RECURRENT and tensors:
        rows = sum(one.shape[0] for one in tensors[1:] if one.ndim)
        return _sizes(tensors[0]) // _inner_size(tensors[0]) * max(1, rows)
    return math.prod(map(_sizes, tensors))


def _inner_size(tensor: torch.Tensor) -> int:
    return max(1, tensor.shape[-1]) if tensor.ndim else 1


def _product_cost(
    name: str, arguments: list[Any], tensors: list[torch.Tensor], elements: int
) -> tuple[int, int]:
    """Return multiplications, and an upper bound on the elements of intermediate results."""
    if name in _PRODUCTS and len(tensors) >= 2:
        first, second = tensors[_PRODUCTS[name] : _PRODUCTS[name] + 2]
        inner = _inner_size(first)
        if min(first.ndim, second.ndim) < 3:
            return elements * inner, 0
        # Both are copied for every matrix of the result.
        rows, columns = first.shape[-2], second.shape[-1]
        matrices = elements // max(1, rows * columns)
        return elements * inner, matrices * inner * (rows + columns)
    if name in _CONVOLUTIONS and len(tensors) >= 2:
        seen = math.prod(tensors[1].shape[1:])
        # Every patch that the kernel sees may be copied.
        patches = elements // max(1, tensors[1].shape[0]) * seen
        turned = name == "_convolution" and bool(arguments[6])
        return (elements + turned * tensors[0].numel()) * seen, patches
    if name in _RECURRENT and tensors:
        steps = tensors[0].numel() // _inner_size(tensors[0])
        weights = sum(one.numel() for one in tensors[1:])
        return steps * (weights + OPERATOR_WORK), 8 * elements
    if name == "einsum":
        labels = _label_product(str(arguments[0]), tensors)
        return labels * max(1, len(tensors) - 1), labels if len(tensors) > 2 else 0
    if name in _POOLS:
        window = arguments[1] if isinstance(arguments[1], list | tuple) else [arguments[1]]
        area = math.prod(window) ** (2 if len(window) == 1 and name.endswith("2d") else 1)
        return elements * area, 0
    return 0, 0


def _label_product(equation: str, tensors: list[torch.Tensor]) -> int:
    """Return the product of the sizes of all labels of an einsum; with ``...`` an upper bound."""
    if "." in equation:
        return math.prod(map(_sizes, tensors))
    terms = equation.replace(" ", "").split("->")[0].split(",")
    sizes: dict[str, int] = {}
    for term, tensor in zip(terms, tensors, strict=False):
        for label, size in zip(term, tensor.shape, strict=False):
            sizes[label] = max(1, size, sizes.get(label, 1))
    return math.prod(sizes.values())


def _check_number_of_parts(name: str, arguments: list[Any]) -> None:
    tensor, *rest = arguments
    longest = max(tensor.shape, default=0) if isinstance(tensor, torch.Tensor) else 0
    pieces = rest[0] if rest else 1
    if name == "split" and isinstance(pieces, int) and pieces > 0:
        longest = -(-longest // pieces)
    if name == "chunk" and isinstance(pieces, int):
        longest = min(longest, pieces)
    if longest > _MAX_PARTS and not isinstance(pieces, list):
        raise ForwardPassLimitError(
            f"torch.{name} would give {longest} tensors, expected at most {_MAX_PARTS}"
        )


def _result_elements(name: str, arguments: list[Any], keywords: dict[str, Any]) -> int:
    """Return the elements of a result; only its shape is computed, on PyTorch's meta device."""
    if name == "one_hot":  # its shape may depend on the numbers, which the meta device does not have
        classes = arguments[1] if len(arguments) > 1 and arguments[1] >= 0 else int(arguments[0].max()) + 1
        return int(arguments[0].numel() * classes)
    on_meta = {"device": "meta"} if name in ("zeros", "ones", "full", "arange", "scalar_tensor") else {}
    shaped = getattr(torch.ops.aten, name)(*map(_to_meta, arguments), **(keywords | on_meta))
    results = shaped if isinstance(shaped, list | tuple) else [shaped]
    return sum(one.numel() for one in results if isinstance(one, torch.Tensor))


def _to_meta(argument: Any) -> Any:
    if isinstance(argument, list | tuple):
        return [one.to("meta") if isinstance(one, torch.Tensor) else one for one in argument]
    return argument.to("meta") if isinstance(argument, torch.Tensor) else argument
