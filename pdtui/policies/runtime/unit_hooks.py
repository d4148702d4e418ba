"""Hooks that read and overwrite the outputs of hidden layers while a network runs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.policies.runtime.unit_layers import output_tensor


class UnitHooks:
    """Reads and overwrites the outputs of all hidden layers of one network during a forward pass.

    Attributes:
        outputs: Output of each layer so far, as the next layer sees it, flattened in C order.
        natural: Outputs that the stimulated units would have had, by flat index.
    """

    def __init__(self) -> None:
        self.outputs: list[NDArray[np.float32]] = []
        self.natural: dict[int, float] = {}
        self._pending: tuple[tuple[int, float], ...] = ()
        self._replaced: list[tuple[torch.Tensor, torch.Tensor]] = []
        self._offset = 0

    def begin(self, stimulation: Stimulation = NO_STIMULATION) -> None:
        """Prepare for a forward pass."""
        self.outputs, self._offset = [], 0
        if self._replaced:
            self._replaced = []
        if stimulation.units:
            self._pending = tuple(zip(stimulation.units, stimulation.values, strict=True))
            self.natural = {}
        elif self._pending:
            self._pending = ()

    def replace(self, output: Any) -> Any:
        """Return a hidden submodule's output with stimulated units overwritten; None leaves it unchanged.

        A copy is overwritten, since other layers or the recurrent state may share the memory.
        """
        own = output_tensor(output)
        low, high = self._offset, self._offset + own.numel()
        self._offset = high
        pending = [(unit - low, value) for unit, value in self._pending if low <= unit < high]
        shown = own.clone() if pending else own
        values = shown.numpy()
        for place, value in pending:
            self.natural[low + place] = float(values.flat[place])
            values.flat[place] = value
        self.outputs.append(values.astype(np.float32).reshape(-1))
        if not pending:
            return None
        self._replaced.append((shown, own))
        return (shown, *output[1:]) if isinstance(output, tuple) else shown

    def natural_of(self, tensors: Iterable[torch.Tensor]) -> Iterable[torch.Tensor]:
        """Return the tensors, each that was overwritten in this pass replaced by its natural output."""
        own = {id(shown): natural for shown, natural in self._replaced}
        return (own.get(id(tensor), tensor) for tensor in tensors)
