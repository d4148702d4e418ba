"""What another process answers to a call: a result, or the exception that was raised."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

from pdtui.core.errors import PdtuiError

CallAnswer = tuple[bool, Any]
"""Whether the call succeeded, and its result or its exception."""


def answer_call(function: Callable[..., Any], *arguments: Any) -> CallAnswer:
    """Call a function and return its answer; the exception of a bug says where it was raised."""
    try:
        return True, function(*arguments)
    except Exception as error:
        if not isinstance(error, PdtuiError):
            # Tracebacks are not sent to other processes.
            error.add_note(f"In a worker process:\n{traceback.format_exc()}")
        return False, error


def take_answer(answer: CallAnswer) -> Any:
    """Return the result of a call, or raise its exception."""
    succeeded, value = answer
    if not succeeded:
        raise value
    return value
