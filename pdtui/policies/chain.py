"""A network of layers in a row as plain calls: the same bits in half the time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import torch
from torch import nn

ACTIVATION_TYPES: tuple[type[nn.Module], ...] = (
    nn.Tanh,
    nn.ReLU,
    nn.ELU,
    nn.GELU,
    nn.SiLU,
    nn.LeakyReLU,
    nn.SELU,
    nn.Sigmoid,
    nn.Softplus,
)

Chain = list[tuple[Callable[[torch.Tensor], torch.Tensor], bool]]


def chain_of(module: nn.Module) -> Chain | None:
    """The module as plain calls, each with whether it puts out hidden units; None if it is no chain.

    Calling the same PyTorch functions without the machinery of `nn.Module` gives the same bits in half the
    time, which counts at this size. A module is a chain if it is an `nn.Sequential` of unnamed layers, or has
    a method ``stages()`` that lists its submodules in their order.
    """
    if isinstance(module, nn.Sequential) and all(name.isdigit() for name, _ in module.named_children()):
        stages: list[nn.Module] = list(module)
    elif hasattr(module, "stages"):
        stages = cast(Any, module).stages()
    else:
        return None
    if any(len(list(stage.children())) > 0 or _has_hooks(stage) for stage in stages):
        return None
    return [(_plain_call(stage), isinstance(stage, ACTIVATION_TYPES)) for stage in stages]


def _has_hooks(stage: nn.Module) -> bool:
    return bool(stage._forward_hooks or stage._forward_pre_hooks)


def _plain_call(stage: nn.Module) -> Callable[[torch.Tensor], torch.Tensor]:
    if type(stage) is nn.Linear and stage.bias is not None:
        weight, bias = stage.weight.detach(), stage.bias.detach()
        return lambda x: torch.addmv(bias, weight, x)
    call: Callable[[torch.Tensor], torch.Tensor] = stage.forward
    return call
