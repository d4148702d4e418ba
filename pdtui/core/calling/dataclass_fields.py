"""Functions that take the fields of a dataclass as their arguments."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

Fields = ParamSpec("Fields")
Config = TypeVar("Config")
Result = TypeVar("Result")


def takes_fields_of(
    make_config: Callable[Fields, Config],
) -> Callable[[Callable[[Config], Result]], Callable[Fields, Result]]:
    """Let a function of a dataclass be called with the fields of that dataclass instead."""

    def decorate(function: Callable[[Config], Result]) -> Callable[Fields, Result]:
        @wraps(function)
        def call(*args: Fields.args, **kwargs: Fields.kwargs) -> Result:
            return function(make_config(*args, **kwargs))

        call.__dict__["__signature__"] = inspect.signature(make_config)
        return call

    return decorate
