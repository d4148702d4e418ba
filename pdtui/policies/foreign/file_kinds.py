"""Kinds of files, told by their content, and what is read from each."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import MIB
from pdtui.policies.foreign.array_files import (
    Arrays,
    read_json_arrays,
    read_npz_arrays,
    read_safetensors_arrays,
)
from pdtui.policies.foreign.torch_archive import has_torchscript, read_state_dict, read_torchscript_parts
from pdtui.policies.foreign.zip_archive import ZipArchive

KNOWN_FORMATS = (
    "Stable-Baselines3 .zip, PyTorch .pt or .pth, .npz or .safetensors of RLlib, rsl_rl, CleanRL or a plain "
    "chain of linear layers"
)
_MAX_SB3_DATA = 16 * MIB
_MAX_SB3_TEXT = 100_000
"""Characters of a readable field: the bounds of 1,000 actions take about 10,000."""


class FileKind(Enum):
    """Kinds of files, with their descriptions for messages."""

    ZIP = "a zip archive"
    SAFETENSORS = "safetensors"
    PICKLE = "a pickle"
    HDF5 = "HDF5, such as Keras writes"
    GZIP = "a gzip file"
    ONNX = "ONNX"
    EMPTY = "an empty file"
    UNKNOWN = "no format that pdtui knows"


@dataclass(frozen=True)
class FoundContent:
    """What was read from a file.

    Attributes:
        form: ``tensors``, ``stable-baselines3`` or ``torchscript``.
        arrays: Arrays by name, in the order of the file.
        facts: What else the file says, as JSON: the readable fields of a Stable-Baselines3 archive, or the
            module and the source code of a TorchScript archive.
    """

    form: str
    arrays: Arrays
    facts: dict[str, Any] = field(default_factory=dict)


def detect_file_kind(content: bytes) -> FileKind:
    """Return the kind of a file, told by its first bytes and not by its name."""
    if not content:
        return FileKind.EMPTY
    if content.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return FileKind.ZIP
    if content.startswith(b"\x89HDF"):
        return FileKind.HDF5
    if content.startswith(b"\x1f\x8b"):
        return FileKind.GZIP
    if content[8:9] == b"{" and 0 < int.from_bytes(content[:8], "little") < len(content):
        return FileKind.SAFETENSORS
    # Pickles of protocol 2 and later say so; older ones are text that ends in a full stop.
    if content[:1] == b"\x80" and content[1:2] in b"\x02\x03\x04\x05":
        return FileKind.PICKLE
    if content[:1] in b"(c]})l" and content.rstrip().endswith(b".") and content[:1] != b"{":
        return FileKind.PICKLE
    if content[:1] == b"\x08" and b"onnx" in content[:200].lower():
        return FileKind.ONNX
    return FileKind.UNKNOWN


def read_policy_content(content: bytes, limit: int) -> FoundContent:
    """Return what a policy of another program holds; a file that is none is a `PolicyError`.

    The entries of a zip may unpack to `limit` bytes.
    """
    match detect_file_kind(content):
        case FileKind.ZIP:
            return _read_zip(ZipArchive(content, limit))
        case FileKind.SAFETENSORS:
            return FoundContent("tensors", read_safetensors_arrays(content))
        case FileKind.PICKLE:
            raise PolicyError(
                "a pickle, which can run any code when it is read, so pdtui refuses it; save the tensors "
                "alone: torch.save(model.state_dict(), FILE) of PyTorch 1.6 or later, or numpy.savez"
            )
        case other:
            raise PolicyError(f"{other.value}; expected {KNOWN_FORMATS}")


def _read_zip(archive: ZipArchive) -> FoundContent:
    names = archive.names
    if "data" in names and "policy.pth" in names:
        data = _read_sb3_data(archive)
        inner = ZipArchive(archive.read("policy.pth"), archive.limit)
        return FoundContent("stable-baselines3", read_state_dict(inner), data)
    if names and all(name.endswith(".npy") for name in names):
        return FoundContent("tensors", read_npz_arrays(archive))
    if has_torchscript(names):
        return FoundContent("torchscript", *read_torchscript_parts(archive))
    if any(name.endswith("/data.pkl") for name in names):
        return FoundContent("tensors", read_state_dict(archive))
    raise PolicyError(f"a zip that holds no policy: its entries are {archive.listing()}")


def _read_sb3_data(archive: ZipArchive) -> dict[str, Any]:
    """Return the readable fields; of each pickle in base64 only the length, as ``:serialized:``."""
    try:
        data = json.loads(archive.read("data", _MAX_SB3_DATA))
    except (ValueError, RecursionError) as error:
        raise PolicyError(f"entry 'data': expected JSON: {str(error)[:160]}") from error
    if not isinstance(data, dict):
        raise PolicyError(f"entry 'data': expected a JSON object, found {type(data).__name__}")
    return {name: _readable_field(value) for name, value in data.items()}


def _readable_field(value: Any) -> Any:
    if not isinstance(value, dict):
        return value if len(repr(value)) <= _MAX_SB3_TEXT else None
    parts = {name: str(part) for name, part in value.items() if not isinstance(part, bool)}
    parts |= {name: part for name, part in value.items() if isinstance(part, bool)}
    pickled = parts.pop(":serialized:", "")
    readable = {name: part for name, part in parts.items() if len(str(part)) <= _MAX_SB3_TEXT}
    return readable | {":serialized:": len(str(pickled))}


def read_statistics_content(content: bytes, limit: int) -> FoundContent:
    """Return the arrays of a file with statistics of the observation, as `read_policy_content` does."""
    match detect_file_kind(content):
        case FileKind.ZIP:
            return FoundContent("tensors", read_npz_arrays(ZipArchive(content, limit)))
        case FileKind.SAFETENSORS:
            return FoundContent("tensors", read_safetensors_arrays(content))
        case FileKind.PICKLE:
            raise PolicyError(
                f"a pickle, which can run any code when it is read, so pdtui refuses it. {HOW_TO_CONVERT}"
            )
        case _:
            return FoundContent("tensors", read_json_arrays(content))


HOW_TO_CONVERT = (
    "in the Python that trained it: v = VecNormalize.load(FILE, env); numpy.savez('normalizer.npz', "
    "mean=v.obs_rms.mean, var=v.obs_rms.var, clip_obs=v.clip_obs, epsilon=v.epsilon)"
)
