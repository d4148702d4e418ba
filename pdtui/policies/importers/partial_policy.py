"""A policy as far as its file states it; import options and the world's spaces complete it.

A `PolicyError` names tensors that are missing or do not fit each other.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.zip_archive import shorten_name_list

Tensors = dict[str, torch.Tensor]
MAX_WIDTH = 1_000_000
"""Inputs or outputs of a layer, beyond which a file is damaged or hostile."""
OutputKind = Literal["action", "categorical", "gaussian pair", "unknown pair"]


@dataclass(frozen=True)
class LinearLayer:
    """A layer ``x ↦ weight x + bias``: weight of shape (outputs, inputs), bias of shape (outputs,)."""

    weight: torch.Tensor
    bias: torch.Tensor

    @property
    def shape(self) -> tuple[int, int]:
        """Number of outputs and of inputs."""
        return self.weight.shape[0], self.weight.shape[1]


@dataclass(frozen=True)
class ObservationStatistics:
    """Mean and standard deviation, shape (observations,), by which observations are normalized.

    The magnitude of normalized observations is limited to `clip` unless that is 0.
    """

    mean: torch.Tensor
    std: torch.Tensor
    clip: float = 0.0


@dataclass(frozen=True)
class PartialPolicy:
    """A policy as far as its file states it.

    Attributes:
        origin: The program that wrote the file, for messages.
        layers: All layers in order; the last one is the head.
        output: What the head's outputs are: the ``action`` or its mean, the logits of a ``categorical``
            distribution, or a ``gaussian pair`` of mean and log standard deviation. With ``unknown pair``,
            the world's spaces decide which of these.
        activation: Activation function; empty where the file does not state it.
        squash: ``none``, ``tanh`` or ``clip``; empty where the file does not state it.
        low, high: Bounds of the action; empty where the file does not state them.
        log_std: Log standard deviation, shape (actions,), where it is a parameter.
        log_std_low, log_std_high, log_std_rule, mean_limit: As in `NetworkSpec`.
        statistics: Statistics of the observation, if the policy normalizes it.
    """

    origin: str
    layers: tuple[LinearLayer, ...]
    output: OutputKind = "action"
    activation: str = ""
    squash: str = ""
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()
    log_std: torch.Tensor | None = None
    log_std_low: float = -20.0
    log_std_high: float = 20.0
    log_std_rule: Literal["clip", "tanh"] = "clip"
    mean_limit: float = 0.0
    statistics: ObservationStatistics | None = None


def to_single_precision(tensors: Tensors) -> Tensors:
    """Return the tensors with floating-point ones as float32, as policies compute."""
    return {
        name: tensor.float() if tensor.is_floating_point() else tensor for name, tensor in tensors.items()
    }


def read_linear_layer(tensors: Tensors, prefix: str) -> LinearLayer:
    """Return the layer of ``PREFIX.weight`` and ``PREFIX.bias``; a missing bias is zero."""
    weight = tensors.get(f"{prefix}.weight")
    if weight is None or weight.ndim != 2 or 0 in weight.shape or max(weight.shape) > MAX_WIDTH:
        found = "nothing" if weight is None else f"shape {tuple(weight.shape)}"
        raise PolicyError(f"tensor '{prefix}.weight': expected shape (outputs, inputs), found {found}")
    bias = tensors.get(f"{prefix}.bias", torch.zeros(weight.shape[0]))
    if bias.shape != weight.shape[:1]:
        raise PolicyError(
            f"tensor '{prefix}.bias': expected shape ({weight.shape[0]},), found {tuple(bias.shape)}"
        )
    return LinearLayer(weight.float(), bias.float())


def read_layer_sequence(tensors: Tensors, prefix: str) -> tuple[LinearLayer, ...]:
    """Return the layers ``PREFIX.0``, ``PREFIX.2``, … in the order of their numbers."""
    numbers = re.compile(rf"{re.escape(prefix)}\.(\d{{1,6}})\.weight")
    found = sorted({int(match[1]) for name in tensors if (match := numbers.fullmatch(name))})
    return check_layer_chain([read_linear_layer(tensors, f"{prefix}.{number}") for number in found], prefix)


def check_layer_chain(layers: Iterable[LinearLayer], where: str) -> tuple[LinearLayer, ...]:
    """Return the layers, after checking that each takes what the one before puts out."""
    chain = tuple(layers)
    for number, (before, after) in enumerate(pairwise(chain)):
        if before.shape[0] != after.shape[1]:
            raise PolicyError(
                f"'{where}': layer {number + 1} takes {after.shape[1]} inputs, but layer {number} has "
                f"{before.shape[0]} outputs"
            )
    return chain


def join_mean_and_deviation(mean: LinearLayer, log_std: LinearLayer) -> LinearLayer:
    """Return one head that puts out the mean, then the log standard deviation."""
    if mean.shape != log_std.shape:
        raise PolicyError(f"heads of mean and log std: shapes {mean.shape} and {log_std.shape} differ")
    return LinearLayer(torch.cat([mean.weight, log_std.weight]), torch.cat([mean.bias, log_std.bias]))


def describe_tensors(tensors: Tensors) -> str:
    """List names and shapes for messages."""
    return shorten_name_list([f"{name} {tuple(tensor.shape)}" for name, tensor in tensors.items()])
