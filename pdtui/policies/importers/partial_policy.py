"""What an importer found in a file, before the user's choices and the world's spaces complete it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.tensor_files import Tensors
from pdtui.policies.importers.zip_archive import shorten

MAX_WIDTH = 1_000_000
OutputKind = Literal["action", "categorical", "gaussian pair", "unknown pair"]


@dataclass(frozen=True)
class LinearLayer:
    """One layer ``x ↦ weight x + bias``: weight (outputs, inputs), bias (outputs,)."""

    weight: torch.Tensor
    bias: torch.Tensor

    @property
    def shape(self) -> tuple[int, int]:
        """Outputs, inputs."""
        return self.weight.shape[0], self.weight.shape[1]


@dataclass(frozen=True)
class ObservationStatistics:
    """Running statistics of the observation.

    Attributes:
        mean, std: shape (observations,).
        clip: the normalised observation is clipped to ± this; 0 for no limit.
    """

    mean: torch.Tensor
    std: torch.Tensor
    clip: float = 0.0


@dataclass(frozen=True)
class PartialPolicy:
    """A policy as far as its file states it.

    Attributes:
        origin: which program wrote it, in words.
        layers: in their order; the last one is the head.
        output: what the head puts out: the ``action`` or its mean; logits of a ``categorical`` choice; a
            ``gaussian pair`` of mean and log standard deviation; an ``unknown pair`` may be either of the
            first two or a pair, which the world's spaces decide.
        activation: empty where the file does not say.
        squash: ``none``, ``tanh`` or ``clip``; empty where the file does not say.
        low, high: bounds of the action; empty where the file does not say.
        log_std: shape (actions,), where it is a parameter.
        log_std_low, log_std_high, log_std_rule: as in `NetworkSpec`.
        mean_limit: as in `NetworkSpec`.
        statistics: of the observation.
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

    def having(self, statistics: ObservationStatistics | None) -> PartialPolicy:
        """The same, normalised with these statistics, if any."""
        return self if statistics is None else replace(self, statistics=statistics)


def read_linear_layer(tensors: Tensors, prefix: str) -> LinearLayer:
    """The layer ``prefix.weight`` with ``prefix.bias``, zero where there is none.

    Raises:
        PolicyError: the weight is missing, or shapes do not go together.
    """
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
    """The layers ``prefix.0``, ``prefix.2``, … in the order of their numbers.

    Raises:
        PolicyError: as `read_linear_layer`; or widths that do not go on from layer to layer.
    """
    numbers = re.compile(rf"{re.escape(prefix)}\.(\d{{1,6}})\.weight")
    found = sorted({int(match[1]) for name in tensors if (match := numbers.fullmatch(name))})
    return check_layer_chain([read_linear_layer(tensors, f"{prefix}.{number}") for number in found], prefix)


def check_layer_chain(layers: Iterable[LinearLayer], where: str) -> tuple[LinearLayer, ...]:
    """The layers, seen to go on from one to the next.

    Raises:
        PolicyError: a layer takes in another width than the one before puts out.
    """
    chain = tuple(layers)
    for number, (before, after) in enumerate(pairwise(chain)):
        if before.shape[0] != after.shape[1]:
            raise PolicyError(
                f"'{where}': layer {number + 1} takes {after.shape[1]} inputs, but layer {number} has "
                f"{before.shape[0]} outputs"
            )
    return chain


def split_mean_and_deviation_head(mean: LinearLayer, log_std: LinearLayer) -> LinearLayer:
    """One head that puts out the mean and then the log standard deviation.

    Raises:
        PolicyError: the two have different shapes.
    """
    if mean.shape != log_std.shape:
        raise PolicyError(f"heads of mean and log std: shapes {mean.shape} and {log_std.shape} differ")
    return LinearLayer(torch.cat([mean.weight, log_std.weight]), torch.cat([mean.bias, log_std.bias]))


def describe_tensors(tensors: Tensors) -> str:
    """Names and shapes, for messages."""
    return shorten([f"{name} {tuple(tensor.shape)}" for name, tensor in tensors.items()])
