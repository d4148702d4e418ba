"""Reads the network of a TorchScript file."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.torchscript.pickle_reader import PickledObject, Storage, read_pickle
from pdtui.policies.torchscript.torchscript_program import InterpretedModule, TorchScriptProgram

_MAX_BYTES = 1 << 30
"""Unpacked bytes of an archive."""
_KINDS = {
    "FloatStorage": torch.float32,
    "DoubleStorage": torch.float64,
    "HalfStorage": torch.float16,
    "LongStorage": torch.int64,
    "IntStorage": torch.int32,
    "ByteStorage": torch.uint8,
    "BoolStorage": torch.bool,
}


def is_torchscript(path: Path) -> bool:
    """Return whether a file is an archive with TorchScript code."""
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.split("/", 1)[-1].startswith("code/__torch__") for name in archive.namelist())
    except (OSError, zipfile.BadZipFile, ValueError):
        return False


def read_torchscript(path: Path) -> torch.nn.Module:
    """Return the network of a file that ``torch.jit.save`` wrote, scripted or traced, on the CPU.

    Submodules keep their names. Code that cannot be interpreted (a loop, an operator that is not listed) is
    refused when it is reached, at the latest when a `Policy` tries the network.

    Raises:
        PolicyError: The file is not a TorchScript archive, is damaged, or holds code that pdtui refuses to
            run.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(info.file_size for info in archive.infolist()) > _MAX_BYTES:
                raise PolicyError(f"{path}: expected an archive of at most {_MAX_BYTES >> 20} MiB")
            entries = {
                info.filename.split("/", 1)[-1]: archive.read(info)
                for info in archive.infolist()
                if not info.filename.endswith(".debug_pkl")
            }
    except (OSError, zipfile.BadZipFile, zlib.error, NotImplementedError, ValueError, RuntimeError) as error:
        raise PolicyError(f"{path}: expected a TorchScript archive: {error}") from error
    if "data.pkl" not in entries:
        raise PolicyError(f"{path}: expected a TorchScript archive, found {', '.join(sorted(entries)[:6])}")
    root = read_pickle(entries["data.pkl"], _storage_reader(entries, "data"), f"{path}: data.pkl")
    if not isinstance(root, PickledObject):
        raise PolicyError(f"{path}: expected a TorchScript module, found {type(root).__name__}")
    constants: Any = ()
    if "constants.pkl" in entries:
        source = f"{path}: constants.pkl"
        constants = read_pickle(entries["constants.pkl"], _storage_reader(entries, "constants"), source)
    texts = {
        name.removeprefix("code/").removesuffix(".py").replace("/", "."): content.decode("utf-8", "replace")
        for name, content in entries.items()
        if name.startswith("code/") and name.endswith(".py")
    }
    try:
        return InterpretedModule(root, TorchScriptProgram(texts, tuple(constants)), {})
    except (PolicyError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise PolicyError(f"{path}: {error}") from error


def _storage_reader(entries: dict[str, bytes], folder: str) -> Storage:
    def storage(key: str, kind: str, count: int) -> torch.Tensor:
        dtype = _KINDS.get(kind.rpartition(".")[2])
        if dtype is None:
            raise PolicyError(f"holds numbers of kind '{kind[:60]}', expected {', '.join(_KINDS)}")
        content = entries[f"{folder}/{key}"]
        if len(content) != count * dtype.itemsize:
            raise PolicyError(f"storage '{key}': expected {count} numbers, found {len(content)} bytes")
        return torch.frombuffer(bytearray(content), dtype=dtype) if count else torch.empty(0, dtype=dtype)

    return storage
