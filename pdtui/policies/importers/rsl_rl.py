"""rsl_rl weights: a checkpoint ``.pt``, or its tensors in an ``.npz`` or ``.safetensors``.

Three generations of names are understood: ``actor.0.weight`` with ``std`` or ``log_std``; the same with
``actor_obs_normalizer``, or statistics under ``obs_norm_state_dict``; and ``actor_state_dict`` with
``mlp.0.weight`` and ``distribution.std_param``.
"""

from __future__ import annotations

import re
from itertools import chain

import torch

from pdtui.policies.importers.partial_policy import (
    ObservationStatistics,
    PartialPolicy,
    Tensors,
    read_layer_sequence,
)

# rsl_rl's EmpiricalNormalization divides by std + 0.01, a constant that it does not store.
_EPSILON = 1e-2
_STDS = ("std", "distribution.std_param")
_LOG_STDS = ("log_std", "distribution.log_std_param")
_NORMALIZERS = ("actor_obs_normalizer", "obs_normalizer", "obs_norm_state_dict")


def import_rsl_rl(tensors: Tensors) -> PartialPolicy | None:
    """Return the actor in rsl_rl's weights; None if the tensors have other names."""
    named = _strip_wrappers(tensors)
    prefix = next((prefix for prefix in ("actor", "mlp") if f"{prefix}.0.weight" in named), None)
    log_std = _find_log_std(named)
    if prefix is None or log_std is None:
        return None
    layers = read_layer_sequence(named, prefix)
    statistics = _observation_statistics(named)
    return PartialPolicy("rsl_rl", layers, squash="none", log_std=log_std, statistics=statistics)


def _strip_wrappers(tensors: Tensors) -> Tensors:
    """Return the tensors without the prefixes that a checkpoint puts before the actor's names."""
    return {re.sub(r"^(model|actor)_state_dict\.", "", name): tensor for name, tensor in tensors.items()}


def _find_log_std(named: Tensors) -> torch.Tensor | None:
    stated = (named[name] for name in _LOG_STDS if name in named)
    derived = (torch.log(named[name].clamp(min=1e-6)) for name in _STDS if name in named)
    return next(chain(stated, derived), None)


def _observation_statistics(named: Tensors) -> ObservationStatistics | None:
    for prefix in _NORMALIZERS:
        mean, std = named.get(f"{prefix}._mean"), named.get(f"{prefix}._std")
        if mean is not None and std is not None:
            return ObservationStatistics(mean.reshape(-1), std.reshape(-1) + _EPSILON)
    return None
