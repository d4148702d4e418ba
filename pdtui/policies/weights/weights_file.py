"""Weights on disk: safetensors whose metadata states everything else about the network."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from hashlib import file_digest
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import WEIGHTS_BUDGET, open_regular_file
from pdtui.policies.weights.policy_file_lookup import find_file_beside, find_package_policy, is_file
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork, check_tensor_shapes

WEIGHTS = Path(__file__).parent / "shipped"
CHECKPOINT_FOLDER = "checkpoints"
"""Folder of the policies that a training run keeps on request, each named by its control steps."""
_KEY = "pdtui"
_NORMALIZER, _NORMALIZER_IN_FILES = "normalizer.", "normaliser."
"""How the names of its tensors begin; files have kept the spelling with which the format began."""
_MAX_HEADER = 1 << 20
"""Bytes of a file's header, which is read at once; that of a network of 100 layers has 20,000."""


def find_weights_file(name: str, folders: Sequence[Path] = ()) -> Path:
    """Return the path of a weights file: as given, in one of the folders, or a shipped one by its name.

    A name such as ``metadrive:expert`` is that of a policy that comes with another package. If there is none,
    a `PolicyError` lists the shipped policies.
    """
    own = find_file_beside(name, folders)
    if own is not None:
        return own
    if is_file(shipped := WEIGHTS / f"{name}.safetensors"):
        return shipped
    if (packaged := find_package_policy(name)) is not None:
        return packaged
    known = ", ".join(sorted(path.stem for path in WEIGHTS.glob("*.safetensors"))) or "none"
    raise PolicyError(f"no policy '{name}': neither a file nor a shipped policy; shipped policies: {known}")


def is_own_format(path: Path) -> bool:
    """Return whether `save_network` wrote the file: safetensors with pdtui's metadata."""
    try:
        # Refuses pipes, on which opening could wait forever.
        with open_regular_file(path) as file:
            start = file.read(9)
        if start[8:] != b"{" or int.from_bytes(start[:8], "little") > _MAX_HEADER:
            return False
        with safe_open(str(path), framework="pt") as handle:
            return _KEY in (handle.metadata() or {})
    except (OSError, SafetensorError, ValueError):
        return False


def hash_file(path: Path) -> str:
    """Return the SHA-256 of a file of weights as hexadecimal digits; `PolicyError` if it cannot be read."""
    try:
        with open_regular_file(path, WEIGHTS_BUDGET.bytes) as file:
            return file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise PolicyError(f"{path}: cannot be read: {error.strerror}") from error


def save_network(path: Path, network: PolicyNetwork) -> None:
    """Write weights as float32 and their metadata; `PolicyError` if the file cannot be written."""
    tensors = {
        name.replace(_NORMALIZER, _NORMALIZER_IN_FILES): tensor.detach().float().contiguous()
        for name, tensor in network.state_dict().items()
    }
    payload = save(tensors, metadata={_KEY: json.dumps(asdict(network.spec), sort_keys=True)})
    write_file(path, payload, PolicyError)


def load_network(path: Path) -> PolicyNetwork:
    """Read a network that `save_network` wrote.

    A file that is no safetensors file, lacks pdtui's metadata or has other tensors is a `PolicyError`.
    """
    metadata, tensors = _read_safetensors(path)
    if _KEY not in metadata:
        found = ", ".join(sorted(tensors)[:6])
        raise PolicyError(f"{path}: expected metadata '{_KEY}' in the file; it holds tensors {found}")
    try:
        fields: dict[str, Any] = json.loads(metadata[_KEY])
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
        raise PolicyError(f"{path}: metadata '{_KEY}' is not complete: {error}") from error
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
