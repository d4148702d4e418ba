"""Named tensors from ``.npz``, ``.safetensors`` and PyTorch archives; nothing in the files is executed.

PyTorch stores the names of tensors in a pickle. It is read by `torch.load(weights_only=True)`, which is not
Python's unpickler: it understands only tensors, containers and numbers, and calls nothing else that the file
names. Old PyTorch files that are a bare pickle are refused, like every other pickle.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load as load_safetensors

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.zip_archive import ZipArchive

Tensors = dict[str, torch.Tensor]
_MAX_NESTING = 6
"""Levels of containers that are searched for tensors."""
_MAX_PICKLE = 64 << 20
"""Bytes of the pickle with the names of tensors."""
_MAX_HEADER = 10_000
"""Bytes of an array's header."""


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


def read_npz_tensors(archive: ZipArchive) -> Tensors:
    """Return the arrays of an ``.npz`` in the order of the file; arrays of Python objects are refused."""
    return {
        name.removesuffix(".npy"): torch.from_numpy(
            _read_array(archive.read(name), f"{archive.source}: '{name}'")
        )
        for name in archive.names
    }


def _read_array(content: bytes, where: str) -> np.ndarray[Any, Any]:
    stream = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(stream)
        form = np.lib.format
        read = form.read_array_header_1_0 if version == (1, 0) else form.read_array_header_2_0
        shape, in_columns, kind = read(stream, max_header_size=_MAX_HEADER)
    except (ValueError, EOFError) as error:
        raise PolicyError(f"{where}: not an array that NumPy wrote: {error}") from error
    if kind.hasobject:
        raise PolicyError(
            f"{where}: holds Python objects, which could only be read by unpickling; pdtui never unpickles"
        )
    if kind.kind not in "fiub":
        raise PolicyError(f"{where}: expected numbers, found {kind}")
    expected, found = math.prod(shape) * kind.itemsize, len(content) - stream.tell()
    if expected != found:
        raise PolicyError(f"{where}: shape {shape} of {kind} takes {expected} bytes, found {found}")
    flat = np.frombuffer(content, kind, offset=stream.tell())
    array = flat.reshape(shape, order="F" if in_columns else "C")
    return np.array(array, kind.newbyteorder("="), order="C")


def read_safetensors_tensors(content: bytes, source: str) -> Tensors:
    """Return the tensors of a safetensors file."""
    try:
        tensors: Tensors = load_safetensors(content)
    except (SafetensorError, ValueError, KeyError) as error:
        raise PolicyError(f"{source}: not a whole safetensors file: {error}") from error
    return tensors


def read_torch_archive(content: bytes, source: str) -> dict[str, Any]:
    """Return what a PyTorch archive holds: tensors inside containers, for `flatten_tensors`."""
    archive = ZipArchive(content, source)
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        if any(info.compress_type != zipfile.ZIP_STORED for info in packed.infolist()):
            raise PolicyError(f"{source}: expected a PyTorch archive, whose entries are never compressed")
        if any(i.file_size > _MAX_PICKLE for i in packed.infolist() if i.filename.endswith(".pkl")):
            raise PolicyError(f"{source}: expected names of tensors of at most {_MAX_PICKLE >> 20} MiB")
    try:
        loaded = torch.load(io.BytesIO(content), map_location="cpu", weights_only=True, mmap=False)
    except Exception as error:
        raise PolicyError(f"{source}: {_explain_failure(error)}; it holds {archive.listing()}") from error
    return loaded if isinstance(loaded, dict) else {"": loaded}


def _explain_failure(error: Exception) -> str:
    """Return in one line why PyTorch's safe reader gave up."""
    text = str(error)
    found = next((line.strip() for line in text.splitlines() if "GLOBAL" in line), "")
    if found:
        return (
            f"holds objects other than tensors, which pdtui does not load ({found[:160]}); save the state "
            "dict alone: torch.save(model.state_dict(), FILE)"
        )
    return f"a PyTorch file that is cut off or damaged: {text.splitlines()[0].split('. ')[0][:160]}"


def flatten_tensors(content: Any, prefix: str = "", depth: int = 0) -> Tensors:
    """Return all tensors in nested containers by dotted names, floating-point ones as float32."""
    if isinstance(content, torch.Tensor):
        return {prefix: _check_tensor(content, prefix)}
    if depth > _MAX_NESTING:
        return {}
    if isinstance(content, Mapping):
        items = [(str(name), value) for name, value in content.items()]
    elif isinstance(content, list | tuple):
        items = [(str(number), value) for number, value in enumerate(content)]
    else:
        return {}
    tensors: Tensors = {}
    for name, value in items:
        tensors |= flatten_tensors(value, f"{prefix}.{name}" if prefix else name, depth + 1)
    return tensors


def _check_tensor(tensor: torch.Tensor, name: str) -> torch.Tensor:
    if tensor.layout is not torch.strided or tensor.is_quantized or tensor.is_meta:
        raise PolicyError(f"tensor '{name}': expected plain numbers, found {tensor.layout}")
    stored = tensor.untyped_storage().nbytes() // tensor.element_size()
    if tensor.numel() > stored:
        raise PolicyError(f"tensor '{name}': shape {tuple(tensor.shape)} claims more numbers than are stored")
    tensor = tensor.detach()
    return tensor.float().contiguous() if tensor.is_floating_point() else tensor
