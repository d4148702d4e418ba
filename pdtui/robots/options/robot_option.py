"""An option of a robot: what values it takes, and what is wrong with a value."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pdtui.core.errors import PdtuiError, RobotError

OptionValue = str | int | float | bool
RobotOptions = Mapping[str, OptionValue]

NO_ROBOT_OPTIONS: RobotOptions = MappingProxyType({})
MAX_OPTION_TEXT = 200
"""Largest number of characters in a text."""
MAX_OPTION_NUMBER = 1e30
"""Largest magnitude of a number."""
_WORDS: dict[type, str] = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}


@dataclass(frozen=True)
class RobotOption:
    """An option of a robot.

    Attributes:
        name: Name of the option, an argument of the robot's class.
        types: Types of its values.
        choices: Its values, where there are only a few.
        default: Value if it is not given; None if the class has none or does not say.
        description: What it does, as the class's docstring says; empty if that says nothing.
        takes_paths: Whether a text may be a path. One in a map or a session that somebody sent would make
            pdtui read another file, and a session would not contain that file.
    """

    name: str
    types: tuple[type, ...]
    choices: tuple[OptionValue, ...] = ()
    default: OptionValue | None = None
    description: str = ""
    takes_paths: bool = True

    @property
    def expected(self) -> str:
        """What the option expects, in words."""
        if self.choices:
            return f"one of {', '.join(map(format_option_value, self.choices))}"
        types = [one for one in self.types if one is not int or float not in self.types]
        return " or ".join(_WORDS[one] for one in types)

    def check(self, value: object) -> OptionValue:
        """Return a value in the option's type; a whole number is also a number.

        Raises:
            ValueError: It is of another type or not one of the choices; the message says what is expected.
        """
        if float in self.types and type(value) is int and int not in self.types:
            value = float(value) if abs(value) <= MAX_OPTION_NUMBER else math.inf
        known = not self.choices or value in self.choices
        if not isinstance(value, OptionValue) or type(value) not in self.types or not known:
            raise ValueError(f"expected {self.expected}, found {_describe(value)}")
        if isinstance(value, str) and not self.takes_paths and _is_path(value):
            raise ValueError(f"expected text that is no path, found {_describe(value)}")
        return require_usable_value(value)

    def parse(self, text: str) -> OptionValue:
        """Return the value that somebody typed.

        Raises:
            ValueError: It is not one of the option's values; the message says what is expected.
        """
        readings: list[object] = []
        if bool in self.types and text in ("true", "false"):
            readings.append(text == "true")
        for number in (int, float):
            if number in self.types:
                try:
                    readings.append(number(text))
                except ValueError:
                    continue
        return self.check(readings[0] if readings else text)

    def __str__(self) -> str:
        default = "" if self.default is None else f", default {format_option_value(self.default)}"
        return f"{self.name} ({self.expected}{default})"


def require_usable_value(value: OptionValue) -> OptionValue:
    """Return a text that is printable and short, or a number that is finite; others are a `ValueError`."""
    if isinstance(value, str):
        if len(value) > MAX_OPTION_TEXT:
            raise ValueError(f"expected at most {MAX_OPTION_TEXT} characters, found {len(value)}")
        if not value.isprintable():
            raise ValueError("expected printable text, found a control character")
    elif not abs(value) <= MAX_OPTION_NUMBER:  # NaN is not
        raise ValueError(f"expected a finite number, at most {MAX_OPTION_NUMBER:g}")
    return value


def check_robot_options(
    robot: str,
    available: Sequence[RobotOption],
    values: Mapping[str, object],
    error: Callable[[str, str], PdtuiError] | None = None,
) -> dict[str, OptionValue]:
    """Return options in their types, in the order in which they are given.

    Args:
        robot: Name of the robot, for messages.
        available: Its options.
        values: Values by name.
        error: Returns what to raise, from the name of an option and what is wrong with it; by default a
            `RobotError`.

    Raises:
        PdtuiError: There is no such option, or it does not take the value.
    """

    def robot_error(name: str, problem: str) -> PdtuiError:
        return RobotError(f"robot '{robot}': option '{name}': {problem}")

    make_error, checked = error or robot_error, {}
    for name, value in values.items():
        try:
            checked[name] = find_option(available, name).check(value)
        except ValueError as problem:
            raise make_error(name, str(problem)) from problem
    return checked


def find_option(available: Sequence[RobotOption], name: str) -> RobotOption:
    """Return the option of a name; if there is none, a `ValueError` lists those that there are."""
    for option in available:
        if option.name == name:
            return option
    known = "; ".join(map(str, available)) or "none"
    raise ValueError(f"no such option; available: {known}")


def format_option_value(value: OptionValue) -> str:
    """Return a value as it is typed."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value).removesuffix(".0") if isinstance(value, float) else str(value)


def format_robot_options(options: RobotOptions) -> str:
    """Return options as a list of ``name = value``, in one line."""
    return ", ".join(f"{name} = {format_option_value(value)}" for name, value in options.items())


def _is_path(text: str) -> bool:
    return text.startswith((".", "~")) or "/" in text or "\\" in text


def _describe(value: object) -> str:
    if isinstance(value, str):
        return f"'{value[:40]}'"
    return str(value) if isinstance(value, bool | int | float) else f"a {type(value).__name__}"
