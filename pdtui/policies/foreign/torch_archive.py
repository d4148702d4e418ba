"""PyTorch archives as plain arrays: state dicts that ``torch.save`` wrote, and TorchScript."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import KIB
from pdtui.policies.foreign.array_files import Arrays, widen_bfloat16
from pdtui.policies.foreign.object_tree import encode_tree
from pdtui.policies.foreign.pickle_reader import (
    MAX_PICKLE,
    ForbiddenCallError,
    PickledObject,
    Storage,
    read_pickle,
)
from pdtui.policies.foreign.zip_archive import ZipArchive, shorten_name_list

MAX_CODE = 256 * KIB
"""Bytes of an archive's source code."""
_MAX_CODE_NODES = 100_000
"""Nodes of the syntax trees of the source code."""
_MAX_NESTING = 6
"""Levels of containers that are searched for tensors."""
_KINDS = {
    "FloatStorage": "<f4",
    "DoubleStorage": "<f8",
    "HalfStorage": "<f2",
    "BFloat16Storage": "bfloat16",
    "LongStorage": "<i8",
    "IntStorage": "<i4",
    "ShortStorage": "<i2",
    "CharStorage": "<i1",
    "ByteStorage": "<u1",
    "BoolStorage": "?",
}


def has_torchscript(names: tuple[str, ...]) -> bool:
    """Return whether these are the entries of a TorchScript archive."""
    return any(_inner(name).startswith("code/__torch__") for name in names)


def read_state_dict(archive: ZipArchive) -> Arrays:
    """Return all tensors in nested containers by dotted names."""
    if archive.compressed:
        raise PolicyError("expected a PyTorch archive, whose entries are never compressed")
    entries = {_inner(name): name for name in archive.names}
    try:
        return _flatten(
            read_pickle(_read_data_pickle(archive, entries), _storage_reader(archive, entries, "data"))
        )
    except ForbiddenCallError as error:
        raise PolicyError(
            f"holds objects other than tensors, which pdtui does not load (it {error}); save the state dict "
            f"alone: torch.save(model.state_dict(), FILE); it holds {archive.listing()}"
        ) from error
    except PolicyError as error:
        raise PolicyError(f"a PyTorch file that is cut off or damaged: {error}") from error


def _flatten(tree: Any, prefix: str = "", depth: int = 0) -> Arrays:
    if isinstance(tree, np.ndarray):
        return {prefix: tree}
    if isinstance(tree, PickledObject):
        raise ForbiddenCallError(f"would build {tree.kind[:100]}")
    if depth > _MAX_NESTING:
        return {}
    if isinstance(tree, Mapping):
        items = [(str(name), value) for name, value in tree.items() if isinstance(name, str | int)]
    elif isinstance(tree, list | tuple):
        items = [(str(number), value) for number, value in enumerate(tree)]
    else:
        return {}
    arrays: Arrays = {}
    for name, value in items:
        arrays |= _flatten(value, f"{prefix}.{name}" if prefix else name, depth + 1)
    return arrays


def read_torchscript_parts(archive: ZipArchive) -> tuple[Arrays, dict[str, Any]]:
    """Return the tensors of a TorchScript archive, and its module, constants and source code as JSON."""
    entries = {_inner(name): name for name in archive.names}
    root = read_pickle(_read_data_pickle(archive, entries), _storage_reader(archive, entries, "data"))
    if not isinstance(root, PickledObject):
        raise PolicyError(f"expected a TorchScript module, found {type(root).__name__}")
    constants: Any = ()
    if "constants.pkl" in entries:
        content = archive.read(entries["constants.pkl"], MAX_PICKLE)
        constants = read_pickle(content, _storage_reader(archive, entries, "constants"))
    sources = [name for name in entries if name.startswith("code/") and name.endswith(".py")]
    code = {
        name.removeprefix("code/").removesuffix(".py").replace("/", "."): archive.read(
            entries[name], MAX_CODE
        ).decode("utf-8", "replace")
        for name in sources
    }
    _check_code(code)
    tree, arrays = encode_tree((root, tuple(constants)))
    return arrays, {"tree": tree, "code": code}


def _check_code(code: dict[str, str]) -> None:
    """Parse the code here, where limits are kept, since it will be parsed again where they are not."""
    if sum(map(len, code.values())) > MAX_CODE:
        raise PolicyError(f"expected source code of at most {MAX_CODE // KIB} KiB, found more")
    nodes = 0
    for module, text in code.items():
        try:
            tree = ast.parse(text)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            # The parser says that memory is short where code is nested too deeply.
            reason = str(error)[:100] or "nested too deeply"
            raise PolicyError(f"code '{module[:100]}': not TorchScript: {reason}") from error
        for node in ast.walk(tree):
            nodes += 1
            if nodes > _MAX_CODE_NODES:
                raise PolicyError(f"its source code has more than {_MAX_CODE_NODES} expressions")
            if isinstance(node, ast.JoinedStr):
                raise PolicyError(f"code '{module[:100]}': not TorchScript: it holds an f-string")


def _read_data_pickle(archive: ZipArchive, entries: dict[str, str]) -> bytes:
    if "data.pkl" not in entries:
        raise PolicyError(f"expected a PyTorch archive, found {shorten_name_list(list(entries))}")
    return archive.read(entries["data.pkl"], MAX_PICKLE)


def _inner(name: str) -> str:
    """Return the name of an entry without the archive's own folder."""
    return name.split("/", 1)[-1]


def _storage_reader(archive: ZipArchive, entries: dict[str, str], folder: str) -> Storage:
    read: dict[str, NDArray[Any]] = {}

    def storage(key: str, kind: str, count: int) -> NDArray[Any]:
        if key in read:
            return read[key]
        dtype = _KINDS.get(kind.rpartition(".")[2])
        if dtype is None:
            raise PolicyError(f"holds numbers of kind '{kind[:60]}', expected {', '.join(_KINDS)}")
        wide = np.dtype("<u2" if dtype == "bfloat16" else dtype)
        content = archive.read(entries[f"{folder}/{key}"])
        if len(content) != count * wide.itemsize:
            raise PolicyError(f"storage '{key[:40]}': expected {count} numbers, found {len(content)} bytes")
        flat = np.frombuffer(content, wide)
        read[key] = widen_bfloat16(flat) if dtype == "bfloat16" else flat
        return read[key]

    return storage
