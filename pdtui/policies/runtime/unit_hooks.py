"""Reading and overwriting the outputs of hidden layers while a network runs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.policies.runtime.unit_layers import output_tensor


class UnitHooks:
    """What sits at the output of every hidden layer of one network, during one forward pass.

    Attributes:
        outputs: of each layer so far, as the next layer sees it, flattened in C order.
        natural: what the stimulated units would have put out, by flat index.
    """

    def __init__(self) -> None:
        self.outputs: list[NDArray[np.float32]] = []
        self.natural: dict[int, float] = {}
        self._pending: tuple[tuple[int, float], ...] = ()
        self._replaced: list[tuple[torch.Tensor, torch.Tensor]] = []
        self._offset = 0

    def begin(self, stimulation: Stimulation = NO_STIMULATION) -> None:
        """A forward pass begins."""
        self.outputs, self._offset = [], 0
        if self._replaced:
            self._replaced = []
        if stimulation.units:
            self._pending = tuple(zip(stimulation.units, stimulation.values, strict=True))
            self.natural = {}
        elif self._pending:
            self._pending = ()

    def replace(self, output: Any) -> Any:
        """Take what a hidden submodule puts out, and return what it puts out instead; None lets it be.

        A copy is overwritten: other layers, or the recurrent state, may hold the same memory.
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
        """The tensors, with the natural output in the place of each that was overwritten in this pass."""
        own = {id(shown): natural for shown, natural in self._replaced}
        return (own.get(id(tensor), tensor) for tensor in tensors)
