"""Running statistics of observations, read from an ``.npz``, ``.json`` or ``.safetensors`` file.

The file holds ``mean`` and ``var``, each of shape (observations,), and optionally ``clip_obs`` and
``epsilon``. An observation o becomes ``clip((o − mean) / sqrt(var + epsilon), ± clip_obs)``, as in
VecNormalize of Stable-Baselines3. A file may hold ``std`` instead of ``var``; then o − mean is divided by it.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.partial_policy import ObservationStatistics
from pdtui.policies.importers.tensor_files import (
    FileKind,
    Tensors,
    detect_file_kind,
    flatten_tensors,
    read_npz_tensors,
    read_safetensors_tensors,
)
from pdtui.policies.importers.zip_archive import ZipArchive, read_file_bytes

_EPSILON = 1e-8
"""The default of VecNormalize."""
HOW_TO_CONVERT = (
    "in the Python that trained it: v = VecNormalize.load(FILE, env); numpy.savez('normaliser.npz', "
    "mean=v.obs_rms.mean, var=v.obs_rms.var, clip_obs=v.clip_obs, epsilon=v.epsilon)"
)


def read_observation_statistics(path: Path, observations: int) -> ObservationStatistics:
    """Read the statistics of observations of this length."""
    tensors = _read_tensors(path)
    if "mean" not in tensors or not {"var", "std"} & tensors.keys():
        raise PolicyError(
            f"{path}: expected 'mean' and 'var' of the observation, found {', '.join(tensors) or 'nothing'}"
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


def _read_tensors(path: Path) -> Tensors:
    content = read_file_bytes(path)
    match detect_file_kind(content):
        case FileKind.ZIP:
            return read_npz_tensors(ZipArchive(content, str(path)))
        case FileKind.SAFETENSORS:
            return flatten_tensors(read_safetensors_tensors(content, str(path)))
        case FileKind.PICKLE:
            raise PolicyError(
                f"{path}: a pickle, which can run any code when it is read, so pdtui refuses it. "
                f"{HOW_TO_CONVERT}"
            )
        case _:
            return _read_json(content, path)


def _read_json(content: bytes, path: Path) -> Tensors:
    try:
        data = json.loads(content)
        if not isinstance(data, dict):
            raise ValueError(f"expected an object, found {type(data).__name__}")
        numbers = {name: value for name, value in data.items() if isinstance(value, list | int | float)}
        return {name: torch.tensor(value, dtype=torch.float64) for name, value in numbers.items()}
    except (ValueError, TypeError, RecursionError, RuntimeError) as error:
        raise PolicyError(f"{path}: expected statistics as .npz, .json or .safetensors: {error}") from error


def _read_number(tensors: Tensors, name: str, default: float, path: Path) -> float:
    if name not in tensors:
        return default
    tensor = tensors[name]
    if tensor.numel() != 1 or not math.isfinite(float(tensor)) or float(tensor) < 0:
        raise PolicyError(f"{path}: '{name}': expected one number that is not negative")
    return float(tensor)
