"""Weights on disk: safetensors whose metadata states everything else about the network."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import WEIGHTS_BUDGET, open_regular_file
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork, check_tensor_shapes
from pdtui.policies.weights.weights_header import METADATA_KEY

CHECKPOINT_FOLDER = "checkpoints"
"""Folder of the policies that a training run keeps on request, each named by its control steps."""
_NORMALIZER, _NORMALIZER_IN_FILES = "normalizer.", "normaliser."
"""How the names of its tensors begin; files have kept the spelling with which the format began."""


def save_network(path: Path, network: PolicyNetwork) -> None:
    """Write weights as float32 and their metadata; `PolicyError` if the file cannot be written."""
    tensors = {
        name.replace(_NORMALIZER, _NORMALIZER_IN_FILES): tensor.detach().float().contiguous()
        for name, tensor in network.state_dict().items()
    }
    payload = save(tensors, metadata={METADATA_KEY: json.dumps(asdict(network.spec), sort_keys=True)})
    write_file(path, payload, PolicyError)


def load_network(path: Path) -> PolicyNetwork:
    """Read a network that `save_network` wrote.

    A file that is no safetensors file, lacks pdtui's metadata or has other tensors is a `PolicyError`.
    """
    metadata, tensors = _read_safetensors(path)
    if METADATA_KEY not in metadata:
        found = ", ".join(sorted(tensors)[:6])
        raise PolicyError(f"{path}: expected metadata '{METADATA_KEY}' in the file; it holds tensors {found}")
    try:
        fields: dict[str, Any] = json.loads(metadata[METADATA_KEY])
        for name in ("layers", "action_low", "action_high"):
            fields[name] = tuple(fields[name])
        spec = NetworkSpec(**fields)
        # Checked before any memory of the stated sizes is allocated.
        spec.check_values()
        with torch.device("meta"):
            expected = PolicyNetwork(spec).state_dict()
        tensors = {name.replace(_NORMALIZER_IN_FILES, _NORMALIZER): one for name, one in tensors.items()}
        check_tensor_shapes(expected, tensors)
        network = PolicyNetwork(spec)
        network.load_tensors(tensors)
    except PolicyError as error:
        raise PolicyError(f"{path}: {error}") from error
    except (TypeError, KeyError, ValueError, RuntimeError, RecursionError) as error:
        raise PolicyError(f"{path}: metadata '{METADATA_KEY}' is not complete: {error}") from error
    return network.eval()


def _read_safetensors(path: Path) -> tuple[dict[str, str], dict[str, torch.Tensor]]:
    try:
        open_regular_file(path, WEIGHTS_BUDGET.bytes).close()
        with safe_open(str(path), framework="pt") as handle:
            metadata: dict[str, str] = handle.metadata() or {}
            return metadata, {name: handle.get_tensor(name) for name in handle.keys()}  # noqa: SIM118
    except (OSError, SafetensorError, RuntimeError, TypeError, ValueError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise PolicyError(f"{path}: expected a safetensors file: {reason}") from error
