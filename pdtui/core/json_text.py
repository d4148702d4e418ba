"""JSON as the commands print it: numbers that JSON does not know become null."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def to_json(data: Any, *, indent: int | None = 2) -> str:
    """Return data as JSON text in which NaN and infinities are ``null``."""
    return json.dumps(_without_nonfinite(data), indent=indent, allow_nan=False)


def _without_nonfinite(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {key: _without_nonfinite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_without_nonfinite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
