"""The options of a robot, read from the signature and the docstring of what builds it."""

from __future__ import annotations

import inspect
import re
import typing
from collections.abc import Callable, Iterator, Mapping
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pdtui.robots.options.robot_option import OptionValue, RobotOption

_SCALARS = (bool, int, float, str)
_ARGS = re.compile(r"^Args:\n((?:[ \t]+.*\n?|[ \t]*\n)*)", re.MULTILINE)
_ENTRY = re.compile(r"(\w+)(?: \(.*?\))?: +(.*)")


def read_constructor_options(build: Callable[..., Any], *, of_bases: bool = True) -> tuple[RobotOption, ...]:
    """Return the options of a class, or of a function that builds an object.

    An option is an argument whose values are texts, numbers, or true and false. Its annotation says so or,
    where there is none, its default; ``Literal`` lists choices. The docstring's ``Args:`` describe it. If
    ``__init__`` takes ``**options``, the arguments of the base class are options, too, if `of_bases`.
    """
    found: dict[str, RobotOption] = {}
    descriptions: dict[str, str] = {}
    for documented, function in _walk_initializers(build, of_bases=of_bases):
        descriptions = {**_read_descriptions(documented), **descriptions}
        for parameter, annotation in _annotated_parameters(function):
            option = _as_option(parameter, annotation)
            if option is not None:
                found.setdefault(option.name, option)
    return tuple(
        RobotOption(one.name, one.types, one.choices, one.default, descriptions.get(one.name, ""))
        for one in found.values()
    )


def option_of_default(name: str, default: object) -> RobotOption | None:
    """Return the option that a default value alone describes; None if it is not of an option's type.

    A whole number may stand for any number.
    """
    if not isinstance(default, OptionValue):
        return None
    return RobotOption(name, (int, float) if type(default) is int else (type(default),), default=default)


def _walk_initializers(
    build: Callable[..., Any], *, of_bases: bool
) -> Iterator[tuple[object, Callable[..., Any]]]:
    """Yield what is documented and what is called: a class, then those of its bases that are called, too."""
    if not isinstance(build, type):
        yield build, build
        return
    for kind in build.__mro__:
        initializer = vars(kind).get("__init__")
        if not inspect.isfunction(initializer):
            continue
        yield kind, initializer
        kinds = [one.kind for one in inspect.signature(initializer).parameters.values()]
        if not of_bases or inspect.Parameter.VAR_KEYWORD not in kinds:
            return


def _annotated_parameters(function: Callable[..., Any]) -> Iterator[tuple[inspect.Parameter, object]]:
    try:
        hints: Mapping[str, object] = typing.get_type_hints(function)
    except Exception:  # an annotation may name what is imported for type checkers only
        hints = {}
    for parameter in inspect.signature(function).parameters.values():
        named = parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
        if named and parameter.name != "self":
            yield parameter, hints.get(parameter.name)


def _as_option(parameter: inspect.Parameter, annotation: object) -> RobotOption | None:
    """Return the option of a parameter; None if its values are neither texts nor numbers."""
    default = None if parameter.default is parameter.empty else parameter.default
    members = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    members = tuple(one for one in members if one is not NoneType)
    if members == (None,):
        return option_of_default(parameter.name, default)
    shown = default if isinstance(default, OptionValue) else None
    if all(get_origin(one) is Literal for one in members):
        choices = tuple(choice for one in members for choice in get_args(one))
        types = tuple(dict.fromkeys(map(type, choices)))
        usable = all(one in _SCALARS for one in types)
        return RobotOption(parameter.name, types, choices, shown) if usable else None
    if not all(one in _SCALARS for one in members):
        return None
    types = tuple(one for one in _SCALARS if one in members)
    if isinstance(shown, int) and types == (float,):
        shown = float(shown)
    return RobotOption(parameter.name, types, default=shown)


def _read_descriptions(documented: object) -> dict[str, str]:
    """Return the descriptions of arguments in a docstring in Google's style, each on one line."""
    section = _ARGS.search(inspect.cleandoc(getattr(documented, "__doc__", None) or ""))
    found: dict[str, str] = {}
    last = ""
    for line in inspect.cleandoc(section[1]).splitlines() if section else ():
        entry = _ENTRY.fullmatch(line)
        if entry is not None:
            last = entry[1]
            found[last] = entry[2].strip()
        elif last:
            found[last] = f"{found[last]} {line.strip()}".strip()
    return {name: text.replace("`", "") for name, text in found.items()}
