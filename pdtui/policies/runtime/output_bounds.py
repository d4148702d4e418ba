"""What the hidden units of a layer can put out by themselves: the bounds of their activation function."""

from __future__ import annotations

import math
from collections.abc import Sequence

from torch import nn

OutputBounds = tuple[float, float]
_UNBOUNDED = (-math.inf, math.inf)
# GELU and SiLU have their minima at −0.7518 and −1.2785.
_BOUNDS: dict[type[nn.Module], OutputBounds] = {
    nn.Tanh: (-1.0, 1.0),
    nn.Softsign: (-1.0, 1.0),
    nn.Sigmoid: (0.0, 1.0),
    nn.Hardsigmoid: (0.0, 1.0),
    nn.ReLU: (0.0, math.inf),
    nn.ReLU6: (0.0, 6.0),
    nn.Softplus: (0.0, math.inf),
    nn.GELU: (-0.17, math.inf),
    nn.SiLU: (-0.2785, math.inf),
    nn.SELU: (-1.7581, math.inf),
}


def find_output_bounds(module: nn.Module) -> OutputBounds:
    """Return the least and the largest output of an activation function or a recurrent layer.

    They are infinite where there is no bound, and for a module that is not known.
    """
    if isinstance(module, nn.RNNBase | nn.RNNCellBase):
        relu = getattr(module, "nonlinearity", "tanh") == "relu"
        return (0.0, math.inf) if relu else (-1.0, 1.0)
    if isinstance(module, nn.ELU):
        return -module.alpha, math.inf
    if isinstance(module, nn.Hardtanh) and not isinstance(module, nn.ReLU6):
        return module.min_val, module.max_val
    return _BOUNDS.get(type(module), _UNBOUNDED)


def find_layer_bounds(module: nn.Module, names: Sequence[Sequence[str]]) -> tuple[OutputBounds, ...]:
    """Return the bounds of each hidden layer, given its names, of which the last is that of its submodule."""
    modules = dict(module.named_modules())
    return tuple(find_output_bounds(modules[own[-1]]) for own in names)
