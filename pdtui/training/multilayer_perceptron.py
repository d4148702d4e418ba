"""Multilayer perceptrons as plain trees of JAX arrays."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

MlpParameters = list[dict[str, jax.Array]]
"""One dictionary per layer: weight ``w``, shape (inputs, outputs), bias ``b`` and, for LayerNorm, ``scale``
and ``shift``."""


def init_mlp_parameters(key: jax.Array, widths: tuple[int, ...], layer_norm: bool) -> MlpParameters:
    """Draw weights uniformly from ±1/√inputs; biases are zero."""
    layers = []
    for fan_in, fan_out in pairwise(widths):
        key, sub_key = jax.random.split(key)
        bound = 1.0 / np.sqrt(fan_in)
        weight = jax.random.uniform(sub_key, (fan_in, fan_out), minval=-bound, maxval=bound)
        layer = {"w": weight, "b": jnp.zeros(fan_out)}
        if layer_norm:
            layer |= {"scale": jnp.ones(fan_out), "shift": jnp.zeros(fan_out)}
        layers.append(layer)
    return layers


def relu(x: Any) -> Any:
    """Rectify an array of NumPy or JAX."""
    return x * (x > 0)


def elu(x: NDArray[np.float32]) -> NDArray[np.float32]:
    """Apply the exponential linear unit to an array of NumPy."""
    return np.maximum(x, 0.0) + np.expm1(np.minimum(x, 0.0))


ACTIVATIONS: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "tanh": (jnp.tanh, np.tanh),
    "relu": (relu, relu),
    "elu": (jax.nn.elu, elu),
}
"""Activation functions of hidden layers by name, for arrays of JAX and of NumPy."""


def apply_mlp(params: MlpParameters, x: Any, activation: Callable[[Any], Any]) -> Any:
    """Apply the hidden layers with an activation function and the last layer without."""
    for layer in params[:-1]:
        x = activation(x @ layer["w"] + layer["b"])
    return x @ params[-1]["w"] + params[-1]["b"]
