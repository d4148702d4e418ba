"""Reading a table of a TOML file field by field, so that a mistake is named by line and field."""

from __future__ import annotations

import math
import re
from typing import Any

from pdtui.core.errors import MapError

NUMBER = (int, float)
MAX_TEXT = 1000
"""Characters of one text."""
MAX_ENTRIES = 4096
"""Entries of one list or table of numbers."""
_MAX_WHOLE = 2**53  # larger ones are no longer what they say once they are floating point


class MapTableReader:
    """One table of the file, read field by field; what is left over at the end is an error."""

    def __init__(self, source: str, text: str, where: str, data: Any, header: str, number: int) -> None:
        self._source, self._text, self._where = source, text, where
        self._header, self._number = header, number
        if not isinstance(data, dict):
            raise MapError(f"{source}: {where}: expected a table, found {_kind(data)}")
        self._data = dict(data)

    def take(self, name: str, kind: type | tuple[type, ...], default: Any = ...) -> Any:
        """A field of some kind; one that is missing without a default is an error."""
        if name not in self._data:
            if default is ...:
                raise self.error(name, "is missing")
            return default
        value = self._data.pop(name)
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise self.error(name, f"expected {_name(kind)}, found {_kind(value)}")
        if isinstance(value, NUMBER) and not _is_bearable(value):
            raise self.error(name, "expected a finite number of bearable size")
        if isinstance(value, list | dict) and len(value) > MAX_ENTRIES:
            raise self.error(name, f"expected at most {MAX_ENTRIES} entries, found {len(value)}")
        return value

    def text(self, name: str, default: Any = ...) -> str:
        """A field of printable text."""
        value: str = self.take(name, str, default)
        if len(value) > MAX_TEXT:
            raise self.error(name, f"expected at most {MAX_TEXT} characters, found {len(value)}")
        if not value.isprintable():
            raise self.error(name, "expected printable text, found a control character")
        return value

    def choice(self, name: str, choices: tuple[str, ...], default: Any = ...) -> str:
        """A field that has one of some values."""
        value = self.text(name, default)
        if value not in choices and value != default:
            raise self.error(name, f"expected one of {', '.join(choices)}, found '{value}'")
        return value

    def table(self, name: str, default: Any = ...) -> MapTableReader | None:
        """A field that is a table itself; None where the default is."""
        value = self.take(name, dict, default)
        if value is None:
            return None
        return MapTableReader(
            self._source, self._text, f"{self._where}, {name}", value, self._header, self._number
        )

    def numbers(self, name: str, default: Any = ...) -> dict[str, float]:
        """A field that is a table of finite numbers."""
        data = self.take(name, dict, default)
        for key, value in data.items():
            if isinstance(value, bool) or not isinstance(value, NUMBER) or not _is_bearable(value):
                raise self.error(name, f"'{key[:80]}': expected a finite number, found {_shown(value)}")
        return {key: float(value) for key, value in data.items()}

    def done(self) -> None:
        """Every field was read: one that is left over is an error."""
        for name in self._data:
            raise self.error(name, "is not a field of this table")

    def error(self, name: str, problem: str) -> MapError:
        """An error that names this table's line and a field."""
        line = _line_of(self._text, self._header, self._number, name)
        return MapError(f"{self._source}:{line}: {self._where}: field '{name}' {problem}")


def _is_bearable(value: float) -> bool:
    """Not infinite, not NaN; TOML's whole numbers have no end either."""
    return abs(value) <= _MAX_WHOLE if isinstance(value, int) else math.isfinite(value)


def _line_of(text: str, header: str, number: int, field: str) -> int:
    """Line of a field in the n-th table with this header; of the header where the field is missing."""
    lines = text.splitlines()
    start = 0
    if header:
        starts = [row for row, line in enumerate(lines) if line.strip().startswith(header)]
        start = starts[number] if number < len(starts) else 0
    pattern = re.compile(rf"""(^|[{{,\s])["']?{re.escape(field)}["']?\s*=""")
    for row in range(start, len(lines)):
        inside = lines[row].strip().startswith(f"[{header.strip('[]')}.")
        if row > start and re.match(r"\s*\[", lines[row]) and header and not inside:
            break
        if pattern.search(lines[row].split("#")[0]):
            return row + 1
    return start + 1


def _shown(value: Any) -> str:
    return repr(value[:40]) if isinstance(value, str) else _kind(value)


def _name(kind: type | tuple[type, ...]) -> str:
    names = {str: "text", int: "a whole number", dict: "a table", list: "a list", bool: "true or false"}
    return "a number" if isinstance(kind, tuple) else names.get(kind, kind.__name__)


def _kind(value: Any) -> str:
    return "a number" if type(value) in NUMBER else _name(type(value))
