"""Multilayer perceptrons as plain trees of JAX arrays."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from pdtui.policies.weights.policy_network import PolicyNetwork

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


ARRAY_ACTIVATIONS: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "tanh": (jnp.tanh, np.tanh),
    "relu": (relu, relu),
    "elu": (jax.nn.elu, elu),
}
"""Activation functions of hidden layers by name, for arrays of JAX and of NumPy."""


def network_to_mlp_parameters(network: PolicyNetwork) -> MlpParameters:
    """Return the weights of the network's hidden layers and head; its normalizer is not among them."""
    return [
        {"w": jnp.asarray(layer.weight.detach().numpy().T), "b": jnp.asarray(layer.bias.detach().numpy())}
        for layer in (*network.hidden, network.head)
    ]


def apply_mlp(
    params: MlpParameters,
    x: Any,
    activation: Callable[[Any], Any],
    intervene: Callable[[Any, int], Any] | None = None,
) -> Any:
    """Apply the hidden layers with an activation function and the last layer without.

    Args:
        params: The layers.
        x: Inputs, shape (..., inputs).
        activation: The activation function of the hidden layers.
        intervene: Returns what the next layer gets instead of a layer's outputs, shape (..., units), and the
            number of hidden units in the layers before it; None for the outputs themselves.
    """
    first = 0
    for layer in params[:-1]:
        x = activation(x @ layer["w"] + layer["b"])
        if intervene is not None:
            x = intervene(x, first)
            first += x.shape[-1]
    return x @ params[-1]["w"] + params[-1]["b"]
