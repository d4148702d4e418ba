"""Generates two pages of the guide: the commands from click, the Python reference from docstrings."""

from __future__ import annotations

import re


def escape_markdown(text: str) -> str:
    """Return text in which nothing but its code, between single or double backticks, is markup."""
    parts = re.split(r"``([^`]+)``|`([^`]+)`", text)
    free = [re.sub(r"([\[\]<*_|])", r"\\\1", part) for part in parts[::3]]
    code = [f"`{double or single}`" for double, single in zip(parts[1::3], parts[2::3], strict=True)]
    return "".join(part for pair in zip(free, [*code, ""], strict=True) for part in pair)
