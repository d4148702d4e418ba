"""The hidden layers of a network: their names, and hooks that read and overwrite what they put out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.core.units import NO_STIMULATION, Stimulation
from pdtui.policies.runtime.fast_mlp import ACTIVATION_TYPES


def find_hidden_modules(module: nn.Module, hidden: Sequence[str] | None, owner: str) -> dict[nn.Module, str]:
    """Return the submodules whose outputs are units, with their names.

    They are those named in `hidden`, by default every activation function and every recurrent layer.
    """
    modules = dict(module.named_modules())
    if hidden is None:
        return {one: name for name, one in modules.items() if _puts_out_units(one)}
    for name in hidden:
        if name not in modules:
            known = ", ".join(filter(None, modules))
            raise PolicyError(f"{owner}: no submodule '{name}'; available: {known}")
    return {modules[name]: name for name in hidden}


def _puts_out_units(module: nn.Module) -> bool:
    known = isinstance(module, (*ACTIVATION_TYPES, nn.RNNBase, nn.RNNCellBase))
    return known or getattr(module, "is_activation", False)


def _has_weights(module: nn.Module) -> bool:
    return next(module.parameters(recurse=False), None) is not None


def _output_tensor(output: Any) -> torch.Tensor:
    """Return the tensor that the next layer reads: of a recurrent layer, the output h without its state."""
    first = output[0] if isinstance(output, tuple) and output else output
    if not isinstance(first, torch.Tensor):
        raise PolicyError(f"a hidden submodule outputs {type(first).__name__}, expected a tensor")
    return first


def name_layers(
    module: nn.Module, chosen: dict[nn.Module, str], run: Callable[[], object]
) -> list[list[str]]:
    """Return the names of the chosen layers in the order in which the network, once it is run, calls them.

    A layer is named after the submodule whose output goes straight into its activation function (``conv1``),
    and also after the activation function itself.
    """
    # Keeping references to the tensors prevents a new tensor from getting the identity of an old one.
    producers: list[tuple[torch.Tensor, str]] = []
    names: list[list[str]] = []

    def produced(name: str) -> Callable[..., None]:
        def hook(_module: nn.Module, _inputs: Any, output: Any) -> None:
            if isinstance(output, torch.Tensor):
                producers.append((output, name))

        return hook

    def visited(name: str) -> Callable[..., None]:
        def hook(_module: nn.Module, inputs: Any) -> None:
            feeding = [other for tensor, other in producers if inputs and tensor is inputs[0]]
            names.append([*feeding[-1:], name])

        return hook

    handles = []
    for name, one in module.named_modules():
        if one in chosen and (not _puts_out_units(one) or _has_weights(one)):
            handles.append(one.register_forward_pre_hook(lambda _module, _inputs, n=name: names.append([n])))
        elif one in chosen:
            handles.append(one.register_forward_pre_hook(visited(name)))
        elif _has_weights(one):
            handles.append(one.register_forward_hook(produced(name)))
    try:
        run()
    finally:
        for handle in handles:
            handle.remove()
    return names


class UnitHooks:
    """Reads and overwrites the outputs of all hidden layers of one network during a forward pass.

    Attributes:
        outputs: Output of each layer so far, as the next layer sees it, flattened in C order.
        natural: Output of each layer so far before the stimulation changed it, flattened likewise.
    """

    def __init__(self) -> None:
        self.outputs: list[NDArray[np.float32]] = []
        self.natural: list[NDArray[np.float32]] = []
        self._stimulation = NO_STIMULATION
        self._replaced: list[tuple[torch.Tensor, torch.Tensor]] = []
        self._offset = 0

    def begin(self, stimulation: Stimulation = NO_STIMULATION) -> None:
        """Prepare for a forward pass."""
        self.outputs, self.natural, self._replaced, self._offset = [], [], [], 0
        self._stimulation = stimulation

    def replace(self, output: Any) -> Any:
        """Return a hidden submodule's output with stimulated units overwritten; None leaves it unchanged.

        A copy is overwritten, since other layers or the recurrent state may share the memory.
        """
        own = _output_tensor(output)
        low, high = self._offset, self._offset + own.numel()
        self._offset = high
        wanted = self._stimulation
        pairs = zip(wanted.units, wanted.values, strict=True)
        pending = [(unit - low, value) for unit, value in pairs if low <= unit < high]
        edits = [edit for edit in wanted.edits if low <= edit.units[0] < high]
        shown = own.clone() if pending or edits else own
        values = shown.numpy()
        natural = values.astype(np.float32).reshape(-1)
        self.natural.append(natural)
        if not pending and not edits:
            self.outputs.append(natural)
            return None
        for place, value in pending:
            values.flat[place] = value
        for edit in edits:
            places = edit.units - low
            values.flat[places] = edit.change(values.flat[places].astype(np.float32))
        self.outputs.append(values.astype(np.float32).reshape(-1))
        self._replaced.append((shown, own))
        return (shown, *output[1:]) if isinstance(output, tuple) else shown

    def natural_of(self, tensors: Iterable[torch.Tensor]) -> Iterable[torch.Tensor]:
        """Return the tensors, each that was overwritten in this pass replaced by its natural output."""
        own = {id(shown): natural for shown, natural in self._replaced}
        return (own.get(id(tensor), tensor) for tensor in tensors)
