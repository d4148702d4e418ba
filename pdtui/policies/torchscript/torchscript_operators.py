"""The operators that a TorchScript network may use: mathematics on tensors, nothing that reaches outside."""

from __future__ import annotations

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

_PLAIN: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "neg": operator.neg,
    "floordiv": operator.floordiv,
    "remainder": operator.mod,
    "eq": operator.eq,
    "ne": operator.ne,
    "lt": operator.lt,
    "le": operator.le,
    "gt": operator.gt,
    "ge": operator.ge,
    "len": len,
    "list": list,
    "__contains__": operator.contains,
    "__is__": operator.is_,
    "__isnot__": operator.is_not,
    "__not__": operator.not_,
    "__and__": operator.and_,
    "__or__": operator.or_,
}
_ANY = ("__is__", "__isnot__", "__not__", "len", "list", "__contains__")
_UNARY = ("neg", "__not__", "len", "list")


def call_operator(name: str, arguments: list[Any], keywords: dict[str, Any]) -> Any:
    """The operator ``torch.name`` of TorchScript.

    Raises:
        PolicyError: it is none of the list.
    """
    on_tensors = any(isinstance(one, torch.Tensor) for one in _flat(arguments))
    if name in _PLAIN and (name in _ANY or not on_tensors):
        if name in ("add", "mul") and not all(isinstance(one, int | float) for one in arguments):
            raise PolicyError(f"uses torch.{name} on other things than numbers and tensors")
        return _PLAIN[name](*arguments[: 1 if name in _UNARY else 2])
    if name == "format":
        return " ".join(str(one)[:80] for one in arguments)
    if name not in TENSOR_OPERATORS:
        raise PolicyError(f"uses the operator '{name[:80]}', which is not on pdtui's list")
    return getattr(torch.ops.aten, name)(*arguments, **keywords)


def _flat(arguments: list[Any]) -> list[Any]:
    return [inner for one in arguments for inner in (one if isinstance(one, list | tuple) else (one,))]
