"""Multilayer perceptrons as plain trees of JAX arrays."""

from __future__ import annotations

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np

MlpParameters = list[dict[str, jax.Array]]


def init_mlp(key: jax.Array, widths: tuple[int, ...], layer_norm: bool) -> MlpParameters:
    """Weights uniform in ±1/√inputs, biases zero."""
    layers = []
    for fan_in, fan_out in pairwise(widths):
        key, sub_key = jax.random.split(key)
        bound = 1.0 / np.sqrt(fan_in)
        layer = {
            "w": jax.random.uniform(sub_key, (fan_in, fan_out), minval=-bound, maxval=bound),
            "b": jnp.zeros(fan_out),
        }
        if layer_norm:
            layer |= {"scale": jnp.ones(fan_out), "shift": jnp.zeros(fan_out)}
        layers.append(layer)
    return layers


def tanh_mlp(params: MlpParameters, x: jax.Array) -> jax.Array:
    """Hidden layers with tanh, the last one linear."""
    for layer in params[:-1]:
        x = jnp.tanh(x @ layer["w"] + layer["b"])
    return x @ params[-1]["w"] + params[-1]["b"]
