"""Reads a table of a map field by field, so that errors name the line and the field."""

from __future__ import annotations

import re
from typing import Any

from pdtui.core.errors import MapError
from pdtui.robots.options.robot_option import OptionValue, require_usable_value

NUMBER = (int, float)
MAX_TEXT = 1000
"""Largest number of characters in a text."""
MAX_ENTRIES = 4096
"""Largest number of entries in a list or a table of numbers."""
_MAX_WHOLE = 2**53
"""Largest whole number; beyond, floating point no longer represents every one."""
_MAX_NUMBER = 1e30
"""Largest magnitude of a number, which products and float32 can still represent."""
_IN_LIMITS = f"a finite number, at most {_MAX_NUMBER:g}, or {_MAX_WHOLE} for whole numbers"


class MapTableReader:
    """Takes the fields out of one table of a map; a `MapError` names one that is missing, wrong or left over.

    Args:
        source: Name of the map in messages.
        text: Text of the map, in which lines are looked up.
        where: Name of the table in messages.
        data: The table.
        header: Header of the table in the text; empty for the top level.
        number: Number of the table among those with this header.
    """

    def __init__(self, source: str, text: str, where: str, data: Any, header: str, number: int) -> None:
        self._source, self._text, self._where = source, text, where
        self._header, self._number = header, number
        if not isinstance(data, dict):
            raise MapError(f"{source}: {where}: expected a table, found {_type_of_value(data)}")
        self._data = dict(data)

    def has(self, name: str) -> bool:
        """Return whether a field is there that was not taken yet."""
        return name in self._data

    def names(self) -> tuple[str, ...]:
        """Return the names of the fields that were not taken yet."""
        return tuple(self._data)

    def take(self, name: str, kind: type | tuple[type, ...], default: Any = ...) -> Any:
        """Take a field of a type, or of one of several; without a default it must be there."""
        if name not in self._data:
            if default is ...:
                raise self.error(name, "missing")
            return default
        value = self._data.pop(name)
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise self.error(name, f"expected {_type_in_words(kind)}, found {_type_of_value(value)}")
        if isinstance(value, NUMBER) and not _is_usable(value):
            raise self.error(name, f"expected {_IN_LIMITS}")
        if isinstance(value, list | dict) and len(value) > MAX_ENTRIES:
            raise self.error(name, f"expected at most {MAX_ENTRIES} entries, found {len(value)}")
        return value

    def number(self, name: str, default: Any = ...) -> Any:
        """Take a field that is a finite number, as a float."""
        value = self.take(name, NUMBER, default)
        return value if value is default else float(value)

    def text(self, name: str, default: Any = ...) -> str:
        """Take a field of printable text."""
        value: str = self.take(name, str, default)
        if len(value) > MAX_TEXT:
            raise self.error(name, f"expected at most {MAX_TEXT} characters, found {len(value)}")
        if not value.isprintable():
            raise self.error(name, "expected printable text, found a control character")
        return value

    def choice(self, name: str, choices: tuple[str, ...], default: Any = ...) -> str:
        """Take a field of text that is one of the choices."""
        value = self.text(name, default)
        if value not in choices and value != default:
            raise self.error(name, f"expected one of {', '.join(choices)}, found '{value}'")
        return value

    def table(self, name: str, default: Any = ...) -> MapTableReader | None:
        """Take a field that is a table; None if it is missing and that is the default."""
        value = self.take(name, dict, default)
        if value is None:
            return None
        return MapTableReader(
            self._source, self._text, f"{self._where}, {name}", value, self._header, self._number
        )

    def tables(self, name: str) -> list[MapTableReader]:
        """Take a field that is a list of tables; empty if it is missing."""
        entries = self.take(name, list, [])
        where = f"{self._where}, {name}"
        return [
            MapTableReader(
                self._source, self._text, f"{where} {number + 1}", entry, self._header, self._number
            )
            for number, entry in enumerate(entries)
        ]

    def number_list(self, name: str, default: Any = ...) -> tuple[float, ...]:
        """Take a field that is a list of finite numbers."""
        values = self.take(name, list, default)
        for value in values:
            if isinstance(value, bool) or not isinstance(value, NUMBER) or not _is_usable(value):
                raise self.error(name, f"expected {_IN_LIMITS}, found {_describe(value)}")
        return tuple(float(value) for value in values)

    def texts(self, name: str) -> tuple[str, ...]:
        """Take a field that is a list of texts; empty if it is missing."""
        values = self.take(name, list, [])
        if not all(isinstance(value, str) for value in values):
            raise self.error(name, "expected a list of texts")
        return tuple(values)

    def numbers(self, name: str, default: Any = ...) -> dict[str, float]:
        """Take a field that is a table of finite numbers."""
        data = self.take(name, dict, default)
        for key, value in data.items():
            if isinstance(value, bool) or not isinstance(value, NUMBER) or not _is_usable(value):
                raise self.error(name, f"'{key[:80]}': expected {_IN_LIMITS}, found {_describe(value)}")
        return {key: float(value) for key, value in data.items()}

    def option_values(self) -> dict[str, OptionValue]:
        """Take all fields, which are texts, numbers, or true or false."""
        values: dict[str, OptionValue] = {}
        for name, value in self._data.items():
            if not isinstance(value, OptionValue):
                raise self.error(name, f"expected text, a number, or true or false, found {_describe(value)}")
            try:
                values[name] = require_usable_value(value)
            except ValueError as problem:
                raise self.error(name, str(problem)) from problem
        self._data = {}
        return values

    def done(self) -> None:
        """Check that every field was taken."""
        for name in self._data:
            raise self.error(name, "not a field of this table")

    def error(self, name: str, problem: str) -> MapError:
        """Return an error that names the line of a field of this table."""
        line = _line_of(self._text, self._header, self._number, name)
        return MapError(f"{self._source}:{line}: {self._where}: field '{name}': {problem}")


def _is_usable(value: float) -> bool:
    """Return whether a number is finite; TOML's whole numbers have no limit of their own."""
    return abs(value) <= (_MAX_WHOLE if isinstance(value, int) else _MAX_NUMBER)  # NaN is not


def _line_of(text: str, header: str, number: int, field: str) -> int:
    """Return the line of a field in the n-th table with this header, or of the header if it is missing."""
    lines = text.splitlines()
    start = 0
    if header:
        starts = [row for row, line in enumerate(lines) if line.strip().startswith(header)]
        start = starts[number] if number < len(starts) else 0
    pattern = re.compile(rf"""(^|[{{,\s])["']?{re.escape(field)}["']?\s*=""")
    for row in range(start, len(lines)):
        inside = lines[row].strip().lstrip("[").startswith(f"{header.strip('[]')}.")
        if row > start and re.match(r"\s*\[", lines[row]) and header and not inside:
            break
        if pattern.search(lines[row].split("#")[0]):
            return row + 1
    return start + 1


def _describe(value: Any) -> str:
    return repr(value[:40]) if isinstance(value, str) else _type_of_value(value)


def _type_in_words(kind: type | tuple[type, ...]) -> str:
    names = {str: "text", int: "a whole number", dict: "a table", list: "a list", bool: "true or false"}
    return "a number" if isinstance(kind, tuple) else names.get(kind, kind.__name__)


def _type_of_value(value: Any) -> str:
    return "a number" if type(value) in NUMBER else _type_in_words(type(value))
