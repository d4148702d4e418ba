"""The operators that a TorchScript network may use: mathematics on tensors, without any side effect."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import torch

from pdtui.core.errors import PolicyError

_LISTED = """
    linear matmul mm addmm bmm mv addmv einsum conv1d conv2d conv3d _convolution
    relu relu_ relu6 tanh tanh_ sigmoid sigmoid_ elu elu_ gelu silu silu_ leaky_relu leaky_relu_ selu selu_
    softplus softsign softmax log_softmax logsumexp hardtanh hardtanh_ hardswish hardsigmoid mish prelu glu
    lstm gru rnn_tanh rnn_relu lstm_cell gru_cell rnn_tanh_cell rnn_relu_cell
    flatten unflatten reshape view squeeze unsqueeze transpose permute t expand expand_as repeat contiguous
    cat stack split chunk unbind select slice narrow index_select gather
    add add_ sub sub_ rsub mul mul_ div div_ neg reciprocal exp log sqrt rsqrt pow square abs sign sin cos
    floor ceil round clamp clamp_ clamp_min clamp_max minimum maximum where eq ne lt le gt ge
    logical_not logical_and logical_or
    mean sum std var prod norm amax amin max min argmax argmin cumsum
    layer_norm batch_norm group_norm instance_norm embedding one_hot
    max_pool1d max_pool2d avg_pool1d avg_pool2d adaptive_avg_pool2d adaptive_max_pool2d
    zeros ones full zeros_like ones_like full_like arange scalar_tensor
    to type_as clone detach dropout dropout_ size dim numel
"""
TENSOR_OPERATORS = frozenset(_LISTED.split())

_RESIZING_LISTED = """
    zeros ones full arange scalar_tensor one_hot expand expand_as repeat unflatten
    conv1d conv2d conv3d _convolution max_pool1d max_pool2d avg_pool1d avg_pool2d adaptive_avg_pool2d
    adaptive_max_pool2d
"""
_RESIZING = frozenset(_RESIZING_LISTED.split())
"""Operators whose result may exceed the product of their tensors' sizes, since numbers choose its size."""
MAX_ELEMENTS = 1 << 26
"""Elements that an operator may create: 256 MiB of float32, far more than a control step needs."""
_MAX_INTEGER = (1 << 63) - 1
"""TorchScript's integers have 64 bits."""

_SAME_NAME = "add sub mul neg floordiv eq ne lt le gt ge __contains__ __not__ __and__ __or__"
_PLAIN: dict[str, Callable[..., Any]] = {
    **{name: getattr(operator, name) for name in _SAME_NAME.split()},
    **{"remainder": operator.mod, "__is__": operator.is_, "__isnot__": operator.is_not},
    **{"len": len, "list": list},
}
"""Operators on numbers and lists, most of which are called as in Python's own `operator`."""
_ANY = ("__is__", "__isnot__", "__not__", "len", "list", "__contains__")
_UNARY = ("neg", "__not__", "len", "list")


def apply_torch_operator(name: str, arguments: list[Any], keywords: dict[str, Any]) -> Any:
    """Apply TorchScript's operator ``torch.NAME``.

    One that is not listed, cannot be computed, or has too large a result is a `PolicyError`.
    """
    tensors = [one for one in _flatten(arguments) if isinstance(one, torch.Tensor)]
    if name in _PLAIN and (name in _ANY or not tensors):
        return _call_on_numbers(name, arguments)
    if name == "format":
        return " ".join(str(one)[:80] for one in arguments)
    if name not in TENSOR_OPERATORS:
        raise PolicyError(f"uses the operator '{name[:80]}', which is not on pdtui's list")
    if name in _RESIZING or _largest_result(name, tensors) > MAX_ELEMENTS:
        _check_result_size(name, arguments, keywords)
    return getattr(torch.ops.aten, name)(*arguments, **keywords)


def _call_on_numbers(name: str, arguments: list[Any]) -> Any:
    if name in ("add", "mul") and not all(isinstance(one, int | float) for one in arguments):
        raise PolicyError(f"uses torch.{name} on something other than numbers and tensors")
    try:
        result = _PLAIN[name](*arguments[: 1 if name in _UNARY else 2])
    except (ArithmeticError, TypeError) as error:
        raise PolicyError(f"cannot compute torch.{name}: {error}") from error
    if isinstance(result, int) and abs(result) > _MAX_INTEGER:
        raise PolicyError(f"torch.{name} gives an integer of more than 64 bits")
    return result


def _largest_result(name: str, tensors: list[torch.Tensor]) -> int:
    """Return an upper bound on the elements of a result whose size no number chooses."""
    if name == "linear":  # its bound is known; the product would count the weights as well
        return tensors[0].numel() * tensors[1].shape[0]
    return math.prod(tensor.numel() for tensor in tensors)


def _check_result_size(name: str, arguments: list[Any], keywords: dict[str, Any]) -> None:
    """Compute only the shape of the result, on PyTorch's meta device, which holds no numbers."""
    if name == "one_hot":  # its shape may depend on the numbers, which the meta device does not have
        classes = arguments[1] if len(arguments) > 1 and arguments[1] >= 0 else int(arguments[0].max()) + 1
        elements = arguments[0].numel() * classes
    else:
        on_meta = {"device": "meta"} if name in ("zeros", "ones", "full", "arange", "scalar_tensor") else {}
        shaped = getattr(torch.ops.aten, name)(*map(_to_meta, arguments), **(keywords | on_meta))
        elements = max(one.numel() for one in _flatten([shaped]))
    if elements > MAX_ELEMENTS:
        raise PolicyError(f"torch.{name} would create {elements} elements, expected at most {MAX_ELEMENTS}")


def _to_meta(argument: Any) -> Any:
    if isinstance(argument, list | tuple):
        return [_to_meta(one) for one in argument]
    return argument.to("meta") if isinstance(argument, torch.Tensor) else argument


def _flatten(arguments: list[Any]) -> list[Any]:
    return [inner for one in arguments for inner in (one if isinstance(one, list | tuple) else (one,))]
