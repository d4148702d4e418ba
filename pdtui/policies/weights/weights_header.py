"""The header of a file of weights that pdtui wrote, which tells what the network is without loading it.

The screen's process imports this module, so PyTorch may not come with it.
"""

from __future__ import annotations

import json
from hashlib import file_digest
from pathlib import Path
from typing import Any

from safetensors import SafetensorError, safe_open

from pdtui.core.errors import PolicyError
from pdtui.core.untrusted_file import WEIGHTS_BUDGET, open_regular_file

METADATA_KEY = "pdtui"
_MAX_HEADER = 1 << 20
"""Bytes of a file's header, which is read at once; that of a network of 100 layers has 20,000."""


def is_own_format(path: Path) -> bool:
    """Return whether `save_network` wrote the file: safetensors with pdtui's metadata."""
    return _read_metadata(path) is not None


def read_weights_header(path: Path) -> dict[str, Any]:
    """Return the fields of a `NetworkSpec` as a file states them, unchecked; none in another format."""
    try:
        fields = json.loads(_read_metadata(path) or "{}")
    except (ValueError, RecursionError):
        return {}
    return fields if isinstance(fields, dict) else {}


def hash_file(path: Path) -> str:
    """Return the SHA-256 of a file of weights as hexadecimal digits; `PolicyError` if it cannot be read."""
    try:
        with open_regular_file(path, WEIGHTS_BUDGET.bytes) as file:
            return file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise PolicyError(f"{path}: cannot be read: {error.strerror}") from error


def _read_metadata(path: Path) -> str | None:
    try:
        # Refuses pipes, on which opening could wait forever.
        with open_regular_file(path) as file:
            start = file.read(9)
        if start[8:] != b"{" or int.from_bytes(start[:8], "little") > _MAX_HEADER:
            return None
        with safe_open(str(path), framework="numpy") as handle:
            found: dict[str, str] = handle.metadata() or {}
            return found.get(METADATA_KEY)
    except (OSError, SafetensorError, ValueError):
        return None
