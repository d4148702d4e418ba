"""Running statistics of observations, read from an ``.npz``, ``.json`` or ``.safetensors`` file.

The file holds ``mean`` and ``var``, each of shape (observations,), and optionally ``clip_obs`` and
``epsilon``. An observation o becomes ``clip((o − mean) / sqrt(var + epsilon), ± clip_obs)``, as in
VecNormalize of Stable-Baselines3. A file may hold ``std`` instead of ``var``; then o − mean is divided by it.
"""

from __future__ import annotations

import math
from pathlib import Path

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.reader_process import read_foreign_file
from pdtui.policies.foreign.zip_archive import shorten_name_list
from pdtui.policies.importers.partial_policy import ObservationStatistics, Tensors

_EPSILON = 1e-8
"""The default of VecNormalize."""


def read_observation_statistics(path: Path, observations: int) -> ObservationStatistics:
    """Read the statistics of observations of this length."""
    tensors = read_foreign_file(path, "statistics").tensors
    if "mean" not in tensors or not {"var", "std"} & tensors.keys():
        raise PolicyError(
            f"{path}: expected 'mean' and 'var' of the observation, found {shorten_name_list(list(tensors))}"
        )
    spread_name = "var" if "var" in tensors else "std"
    mean, spread = tensors["mean"].double(), tensors[spread_name].double()
    for name, tensor in (("mean", mean), (spread_name, spread)):
        if tuple(tensor.shape) != (observations,):
            expected = f"shape ({observations},) as the policy observes"
            raise PolicyError(f"{path}: '{name}': expected {expected}, found {tuple(tensor.shape)}")
        if not bool(torch.isfinite(tensor).all()) or (name != "mean" and bool((tensor < 0).any())):
            raise PolicyError(f"{path}: '{name}': expected finite numbers and no negative variance")
    clip = _read_number(tensors, "clip_obs", 0.0, path)
    epsilon = _read_number(tensors, "epsilon", _EPSILON, path)
    std = torch.sqrt(spread + epsilon) if "var" in tensors else spread
    return ObservationStatistics(mean.float(), std.float(), clip)


def _read_number(tensors: Tensors, name: str, default: float, path: Path) -> float:
    if name not in tensors:
        return default
    tensor = tensors[name]
    if tensor.numel() != 1 or not math.isfinite(float(tensor)) or float(tensor) < 0:
        raise PolicyError(f"{path}: '{name}': expected one number that is not negative")
    return float(tensor)
