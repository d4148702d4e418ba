"""The operators that a TorchScript network may use: mathematics on tensors, without any side effect."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.torchscript.forward_pass_budget import ForwardPassBudget
from pdtui.policies.torchscript.operator_costs import check_operator_cost

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


def apply_torch_operator(
    name: str, arguments: list[Any], keywords: dict[str, Any], budget: ForwardPassBudget
) -> Any:
    """Apply TorchScript's operator ``torch.NAME``.

    One that is not listed, cannot be computed, or takes more than the budget of the pass is a `PolicyError`.
    """
    tensors = [one for one in _flatten(arguments) if isinstance(one, torch.Tensor)]
    if name in _PLAIN and (name in _ANY or not tensors):
        return _call_on_numbers(name, arguments)
    if name == "format":
        return " ".join(str(one)[:80] for one in arguments if isinstance(one, str | int | float))
    if name not in TENSOR_OPERATORS:
        raise PolicyError(f"uses the operator '{name[:80]}', which is not on pdtui's list")
    check_operator_cost(name, arguments, keywords, tensors, budget)
    result = getattr(torch.ops.aten, name)(*arguments, **keywords)
    results = [one for one in _flatten([result]) if isinstance(one, torch.Tensor)]
    budget.count_results(results, tensors)
    return result


def _call_on_numbers(name: str, arguments: list[Any]) -> Any:
    if name in ("add", "mul") and not all(isinstance(one, int | float) for one in arguments):
        raise PolicyError(f"uses torch.{name} on something other than numbers and tensors")
    if name not in _ANY or name == "__contains__":
        # Comparing lists of lists may take forever.
        if any(isinstance(one, list | tuple | dict) for one in _flatten(arguments)):
            raise PolicyError(f"uses torch.{name} on lists in lists")
        if any(isinstance(one, torch.Tensor) for one in _flatten(arguments)):
            raise PolicyError(f"uses torch.{name} on lists of tensors")
    try:
        result = _PLAIN[name](*arguments[: 1 if name in _UNARY else 2])
    except (ArithmeticError, TypeError) as error:
        raise PolicyError(f"cannot compute torch.{name}: {error}") from error
    if isinstance(result, int) and abs(result) > _MAX_INTEGER:
        raise PolicyError(f"torch.{name} gives an integer of more than 64 bits")
    return result


def _flatten(arguments: list[Any]) -> list[Any]:
    return [inner for one in arguments for inner in (one if isinstance(one, list | tuple) else (one,))]
