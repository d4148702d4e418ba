"""Named arrays from ``.npz``, ``.safetensors`` and ``.json`` files; nothing in the files is executed."""

from __future__ import annotations

import ast
import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, deserialize

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.zip_archive import ZipArchive

Arrays = dict[str, NDArray[Any]]
_MAX_HEADER = 10_000
"""Bytes of the header of an ``.npy``."""
_MAX_DIMENSIONS = 32
_SAFETENSORS_KINDS = {
    "F64": "<f8", "F32": "<f4", "F16": "<f2", "BF16": "<u2", "I64": "<i8", "I32": "<i4", "I16": "<i2",
    "I8": "<i1", "U64": "<u8", "U32": "<u4", "U16": "<u2", "U8": "<u1", "BOOL": "?",
}  # fmt: skip


def read_npz_arrays(archive: ZipArchive) -> Arrays:
    """Return the arrays of an ``.npz`` in the order of the file; arrays of Python objects are refused."""
    arrays: Arrays = {}
    for name in archive.names:
        try:
            arrays[name.removesuffix(".npy")] = _read_npy(archive.read(name))
        except PolicyError as error:
            raise PolicyError(f"'{name[:100]}': {error}") from error
    return arrays


def _read_npy(content: bytes) -> NDArray[Any]:
    """Return an array; its header is read here, since NumPy's reader fails in many ways on a hostile one."""
    major = content[6] if content[:6] == b"\x93NUMPY" and len(content) > 12 else 0
    if major not in (1, 2, 3):
        raise PolicyError("not an array that NumPy wrote")
    start = 10 if major == 1 else 12
    length = int.from_bytes(content[8:start], "little")
    if length > min(_MAX_HEADER, len(content) - start):
        raise PolicyError(f"expected a header of at most {_MAX_HEADER} bytes, found {length}")
    try:
        header = ast.literal_eval(content[start : start + length].decode().strip())
        text, in_columns, shape = header["descr"], header["fortran_order"], header["shape"]
    except (ValueError, TypeError, KeyError, SyntaxError, MemoryError, RecursionError) as error:
        raise PolicyError("not an array that NumPy wrote: its header cannot be read") from error
    if not isinstance(text, str):
        raise PolicyError(f"expected numbers, found records {str(text)[:60]}")
    if "O" in text:
        raise PolicyError(
            "holds Python objects, which could only be read by unpickling; pdtui never unpickles"
        )
    kind, offset = _read_kind(text), start + length
    if not isinstance(shape, tuple) or not all(type(size) is int and size >= 0 for size in shape):
        raise PolicyError(f"expected a shape, found {str(shape)[:60]}")
    expected, found = math.prod(shape) * kind.itemsize, len(content) - offset
    if len(shape) > _MAX_DIMENSIONS or max(shape, default=0) > 1 << 40:
        raise PolicyError(f"shape {str(shape)[:80]} is not one that an array can have")
    if expected != found:
        raise PolicyError(f"shape {str(shape)[:80]} of {kind} takes {expected} bytes, found {found}")
    flat = np.frombuffer(content, kind, offset=offset)
    return flat.reshape(shape, order="F" if in_columns else "C").astype(kind.newbyteorder("="), copy=False)


def _read_kind(text: str) -> np.dtype[Any]:
    try:
        kind = np.dtype(text[:20])
    except (TypeError, ValueError, SyntaxError) as error:
        raise PolicyError(f"expected numbers, found '{text[:20]}'") from error
    if kind.kind not in "fiub" or kind.itemsize > 8 or kind.subdtype:
        raise PolicyError(f"expected numbers of at most 8 bytes, found {kind}")
    return kind


def read_safetensors_arrays(content: bytes) -> Arrays:
    """Return the arrays of a safetensors file, those of bfloat16 as float32."""
    arrays: Arrays = {}
    try:
        for name, found in deserialize(content):  # type: ignore[no-untyped-call]
            kind = _SAFETENSORS_KINDS.get(found["dtype"])
            if kind is None:
                raise PolicyError(f"tensor '{name[:80]}': expected plain numbers, found {found['dtype']}")
            array = np.frombuffer(found["data"], kind).reshape(found["shape"])
            arrays[name] = widen_bfloat16(array) if found["dtype"] == "BF16" else array
    except (SafetensorError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise PolicyError(f"not a whole safetensors file: {error}") from error
    return arrays


def widen_bfloat16(array: NDArray[np.uint16]) -> NDArray[np.float32]:
    """Return numbers of bfloat16, given by their bits, as float32, whose upper half they are."""
    return (array.astype("<u4") << 16).view("<f4")


def read_json_arrays(content: bytes) -> Arrays:
    """Return the lists of numbers and the numbers in a JSON object by name."""
    try:
        data = json.loads(content)
        if not isinstance(data, dict):
            raise ValueError(f"expected an object, found {type(data).__name__}")
        numbers = {name: value for name, value in data.items() if isinstance(value, list | int | float)}
        return {name: np.array(value, np.float64) for name, value in numbers.items()}
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        reason = str(error).partition("\n")[0][:160]
        raise PolicyError(f"expected statistics as .npz, .json or .safetensors: {reason}") from error
