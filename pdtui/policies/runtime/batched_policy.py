"""A policy that acts for several robots at once, each with outputs of its units overwritten on its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.attributes import Floats
from pdtui.core.errors import PolicyError
from pdtui.core.units import Stimulation, describe_layers
from pdtui.policies.runtime.fast_mlp import ACTIVATION_TYPES, find_plain_stages
from pdtui.policies.runtime.policy import Policy

_TRIALS, _ROOM = 8, 1e-4
"""Observations on which a batch is compared with the module, and the largest relative deviation."""


class _LayerOverwrites(NamedTuple):
    """Robots and units of one layer, and the outputs that overwrite theirs."""

    rows: torch.Tensor
    columns: torch.Tensor
    outputs: torch.Tensor


class BatchedPolicy:
    """The mean actions of a multilayer perceptron for n observations at once.

    They are those of the policy itself to the rounding of float32.

    Args:
        policy: The policy.
        stages: The submodules of its network in order.
    """

    def __init__(self, policy: Policy, stages: Sequence[nn.Module]) -> None:
        self._policy, self._stages = policy, tuple(stages)
        self._overwrites: dict[int, _LayerOverwrites] = {}
        self._stimulations: Sequence[Stimulation] = ()

    def act(self, observations: Floats, stimulations: Sequence[Stimulation]) -> NDArray[np.float32]:
        """Return the action for each observation, shape (n, A).

        Args:
            observations: The observations, shape (n, O).
            stimulations: For each, the units to overwrite, without edits. The same object is not read again.

        Raises:
            PolicyError: A unit does not exist.
        """
        if stimulations is not self._stimulations:
            self._stimulations, self._overwrites = stimulations, self._find_overwrites(stimulations)
        with torch.inference_mode():
            outputs = self._run(torch.from_numpy(observations.astype(np.float32)), self._overwrites)
            return np.stack([self._policy.decode(output, None) for output in outputs])

    def agrees_with_policy(self) -> bool:
        """Return whether it puts out what the network does, to rounding, for a few random observations."""
        drawn = np.random.default_rng(0).normal(size=(_TRIALS, *self._policy.shape))
        trials = torch.from_numpy(drawn.astype(np.float32))
        with torch.inference_mode():
            try:
                found = self._run(trials, {})
            except (RuntimeError, TypeError, ValueError, IndexError):
                return False
            expected = torch.stack([self._policy.module(trial) for trial in trials])
        scale = max(1.0, float(expected.abs().max()))
        return found.shape == expected.shape and torch.allclose(found, expected, _ROOM, _ROOM * scale)

    def _run(self, x: torch.Tensor, overwrites: dict[int, _LayerOverwrites]) -> torch.Tensor:
        layer = 0
        for stage in self._stages:
            x = stage(x)
            if isinstance(stage, ACTIVATION_TYPES):
                if layer in overwrites:
                    wanted = overwrites[layer]
                    x[wanted.rows, wanted.columns] = wanted.outputs
                layer += 1
        return x

    def _find_overwrites(self, stimulations: Sequence[Stimulation]) -> dict[int, _LayerOverwrites]:
        """Return the overwrites of each layer that has any."""
        if not any(stimulations):
            return {}
        layers = self._policy.layers
        rows = np.repeat(np.arange(len(stimulations)), [len(one.units) for one in stimulations])
        units = np.concatenate([one.units for one in stimulations]).astype(np.intp)
        outputs = np.concatenate([one.values for one in stimulations]).astype(np.float32)
        if units.min() < 0 or units.max() >= self._policy.units:
            wrong = next(unit for unit in units.tolist() if not 0 <= unit < self._policy.units)
            raise PolicyError(
                f"{self._policy.name}: unit number {wrong} does not exist; "
                f"the policy has {describe_layers(layers)}"
            )
        found, low = {}, 0
        for layer, width in enumerate(layers):
            here = (units >= low) & (units < low + width)
            if here.any():
                parts = (rows[here], units[here] - low, outputs[here])
                found[layer] = _LayerOverwrites(*(torch.from_numpy(part) for part in parts))
            low += width
        return found


def make_batched_policy(policy: Policy) -> BatchedPolicy | None:
    """Return the policy for several robots at once; None for a network that is no plain chain of layers."""
    stages = find_plain_stages(policy.module)
    if stages is None or policy.recurrent or len(policy.shape) != 1:
        return None
    batched = BatchedPolicy(policy, stages)
    return batched if batched.agrees_with_policy() else None
