"""Fast forward passes of small multilayer perceptrons.

In a drive, the simulator runs between two passes, so each call meets cold caches. Fewer calls that reuse the
same memory take half the time of a pass.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.units import Stimulation
from pdtui.policies.runtime.output_bounds import find_output_bounds
from pdtui.policies.weights.policy_network import ACTIVATIONS

ACTIVATION_TYPES = tuple(ACTIVATIONS.values())
# Up to this many units, it is faster to overwrite one after the other.
_FEW = 12
_TRIALS = 8
"""Observations on which the fast pass is compared with the module."""


class _LayerCalls(NamedTuple):
    """The calls that compute one layer of units, with flat indices low to high − 1."""

    calls: tuple[Callable[[], Any], ...]
    low: int
    high: int


class FastMlp:
    """Stages that are called one after the other with one vector; a `RuntimeError` says that they do not fit.

    Args:
        stages: Submodules in order, none of them with submodules of its own.
        observations: Length of the observation.
    """

    def __init__(self, stages: list[nn.Module], observations: int) -> None:
        widths = _stage_widths(stages, observations)
        units = [isinstance(stage, ACTIVATION_TYPES) for stage in stages]
        self.layers = tuple(width for width, has_units in zip(widths, units, strict=True) if has_units)
        self.output_bounds = tuple(
            find_output_bounds(one) for one, own in zip(stages, units, strict=True) if own
        )
        self._activations = np.empty(sum(self.layers), np.float32)
        self._natural = np.empty_like(self._activations)
        whole = torch.from_numpy(self._activations)
        x = torch.empty(observations)
        self._input: NDArray[np.float32] = x.numpy()
        parts: list[_LayerCalls] = []
        calls: list[Callable[[], Any]] = []
        low = 0
        for number, (stage, width) in enumerate(zip(stages, widths, strict=True)):
            feeds_units = units[number + 1 : number + 2] == [True] and widths[number + 1] == width
            # A layer is computed where its activation function then works in place.
            out = whole[low : low + width] if units[number] or feeds_units else torch.empty(width)
            calls.append(_build_call(stage, x, out))
            x = out
            if units[number]:
                parts.append(_LayerCalls(tuple(calls), low, low + width))
                calls, low = [], low + width
        self._parts, self._rest, self._output = tuple(parts), tuple(calls), x

    def run(
        self, observation: NDArray[Any], stimulation: Stimulation
    ) -> tuple[torch.Tensor, NDArray[np.float32], NDArray[np.float32]]:
        """Run one forward pass.

        Returns:
            The output, which the next pass overwrites; all activations as the next layers saw them; and the
            activations before the stimulation changed those of each layer.
        """
        self._input[:] = observation
        values = self._activations
        stimulated = bool(stimulation)
        natural = self._natural if stimulated else values
        units, outputs = stimulation.units, stimulation.values
        few = len(units) <= _FEW
        pending = tuple(zip(units, outputs, strict=True)) if few and units else ()
        if not few:
            places, constants = np.array(units), np.array(outputs, np.float32)
        for calls, low, high in self._parts:
            for call in calls:
                call()
            if stimulated:
                natural[low:high] = values[low:high]
            for unit, value in pending:
                if low <= unit < high:
                    values[unit] = value
            if not few:
                here = (places >= low) & (places < high)
                values[places[here]] = constants[here]
            for edit in stimulation.edits:
                if low <= edit.units[0] < high:
                    values[edit.units] = edit.change(values[edit.units])
        for call in self._rest:
            call()
        return self._output, values.copy(), natural

    def run_layers(self, observation: NDArray[Any], last: int) -> NDArray[np.float32]:
        """Run the layers up to that of a unit, and return their activations; the rest is undefined."""
        self._input[:] = observation
        for calls, _, high in self._parts:
            for call in calls:
                call()
            if last < high:
                break
        return self._activations.copy()


def make_fast_mlp(module: nn.Module, observations: int) -> FastMlp | None:
    """Return the module as a `FastMlp`; None unless that gives the same bits on a few observations.

    `find_plain_stages` says what the module must be.
    """
    stages = find_plain_stages(module)
    if stages is None:
        return None
    try:
        chain = FastMlp(stages, observations)
    except (RuntimeError, TypeError, ValueError, IndexError):  # trying the module itself gives the error
        return None
    rng = np.random.default_rng(0)
    for observation in rng.normal(size=(_TRIALS, observations)).astype(np.float32):
        with torch.inference_mode():
            expected: torch.Tensor = module(torch.from_numpy(observation))
        if not torch.equal(chain.run(observation, Stimulation())[0], expected):
            return None
    return chain


def find_plain_stages(module: nn.Module) -> list[nn.Module] | None:
    """Return the submodules that a module calls in a row; None if it names none, or not all are plain.

    It must be an `nn.Sequential` of unnamed layers, or have a method ``stages()`` that returns them.
    """
    if isinstance(module, nn.Sequential) and all(name.isdigit() for name, _ in module.named_children()):
        stages: list[nn.Module] = list(module)
    elif hasattr(module, "stages"):
        stages = cast(Any, module).stages()
    else:
        return None
    return stages if stages and all(_is_plain(stage) for stage in stages) else None


def _is_plain(stage: nn.Module) -> bool:
    """Return whether the stage is a plain call, and any weights of it are those of an `nn.Linear`."""
    if next(stage.children(), None) is not None or stage._forward_hooks or stage._forward_pre_hooks:
        return False
    if getattr(stage, "is_activation", False):
        return False
    return type(stage) is nn.Linear or next(stage.parameters(), None) is None


def _stage_widths(stages: list[nn.Module], observations: int) -> list[int]:
    widths = []
    with torch.inference_mode():
        x = torch.zeros(observations)
        for stage in stages:
            x = stage(x)
            if x.dim() != 1:
                raise RuntimeError("not a chain of vectors")
            widths.append(x.numel())
    return widths


def _build_call(stage: nn.Module, x: torch.Tensor, out: torch.Tensor) -> Callable[[], Any]:
    """Return a call that computes the stage into `out`, in place where `x` is `out`."""
    if type(stage) is nn.Linear and stage.bias is not None:
        return partial(torch.addmv, stage.bias.detach(), stage.weight.detach(), x, out=out)
    if type(stage) is nn.Tanh:
        return partial(torch.tanh, x, out=out)
    if type(stage) is nn.ReLU and x is out:
        return partial(torch.relu_, out)
    forward: Callable[[torch.Tensor], torch.Tensor] = stage.forward

    def compute() -> None:
        with torch.no_grad():
            out.copy_(forward(x))

    return compute
