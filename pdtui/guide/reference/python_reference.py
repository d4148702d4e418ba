"""The page of the guide that describes the public Python interface, from its docstrings."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator
from typing import Any

from pdtui.guide.reference import escape_markdown

_HEAD = """\
# Python

`import pdtui` gives these names. It loads PyTorch and the simulator when one of them is first used.
"""
_SECTION = re.compile(r"(Args|Attributes|Returns|Raises|Note|Example):{1,2}")
_ENTRY = re.compile(r"(\w[\w.*, ]*): +(.*)")
_WIDTH = 88


class _Annotation(str):
    """A postponed annotation, which a signature shows without quotes."""

    def __repr__(self) -> str:
        return str(self)


def render_python_reference(module: Any, *more: type) -> str:
    """Return the Markdown of a module's public functions, then its classes, then its constants.

    Args:
        module: Module whose ``__all__`` is described.
        more: Classes that the functions take or return, described among the others.
    """
    objects = [(name, getattr(module, name)) for name in module.__all__]
    objects += [(value.__name__, value) for value in more]
    functions = [_callable(name, value) for name, value in objects if inspect.isfunction(value)]
    classes = [part for name, value in objects if inspect.isclass(value) for part in _class(name, value)]
    constants = [_constant(name, value) for name, value in objects if not callable(value)]
    return "\n".join([_HEAD, *functions, *classes, *constants])


def _callable(name: str, function: Any, level: int = 2) -> str:
    return "\n".join([_heading(name, level), _fence("python", _signature(name, function)), *_body(function)])


def _signature(name: str, function: Any) -> str:
    """The signature as it was written, on one line if there is room."""
    signature = inspect.signature(function)
    kept = [
        one.replace(annotation=_Annotation(one.annotation))
        for one in signature.parameters.values()
        if one.name != "self"
    ]
    # What a decorator says of the parameters does not know what the function returns.
    returns = function.__annotations__.get("return", signature.return_annotation)
    arrow = "" if returns is signature.empty else f" -> {returns}"
    line = f"{name}{signature.replace(parameters=kept, return_annotation=signature.empty)}{arrow}"
    if len(line) <= _WIDTH:
        return line
    listed = [f"    {one}," for one in kept]
    first = next((place for place, one in enumerate(kept) if one.kind is one.KEYWORD_ONLY), None)
    if first is not None:
        listed.insert(first, "    *,")
    return "\n".join([f"{name}(", *listed, f"){arrow}"])


def _class(name: str, value: type) -> Iterator[str]:
    yield "\n".join([_heading(name, 2), *_body(value)])
    for member, found in vars(value).items():
        if member.startswith("_"):
            continue
        if inspect.isfunction(found):
            yield _callable(f"{name}.{member}", found, 3)
        elif isinstance(found, property):
            yield "\n".join([_heading(f"{name}.{member}", 3), *_body(found)])


def _constant(name: str, value: Any) -> str:
    kind = type(value).__name__
    return f"{_heading(name, 2)}\nAn instance of [{kind}](#{kind.lower()}).\n"


def _heading(name: str, level: int) -> str:
    return f"{'#' * level} {name}\n"


def _fence(language: str, text: str) -> str:
    return f"```{language}\n{text}\n```\n"


def _body(value: Any) -> Iterator[str]:
    """The docstring as Markdown: a list for each of Google's sections, a fence for each example."""
    block: list[str] = []
    section = ""
    for line in [*(inspect.getdoc(value) or "").splitlines(), ""]:
        found = _SECTION.fullmatch(line)
        if found is not None:
            section = found[1]
            yield f"**{section}**\n"
        elif line.strip():
            block.append(line)
        elif block:
            yield _block(textwrap.dedent("\n".join(block)), section)
            section, block = "", []


def _block(text: str, section: str) -> str:
    if text.startswith(">>>"):
        return _fence("pycon", text)
    if section in ("Args", "Attributes", "Raises"):
        # A line that is not indented begins an entry.
        return "".join(f"- {_entry(' '.join(entry.split()))}\n" for entry in re.split(r"\n(?=\S)", text))
    return escape_markdown(" ".join(text.split())) + "\n"


def _entry(text: str) -> str:
    found = _ENTRY.fullmatch(text)
    return f"`{found[1]}`: {escape_markdown(found[2])}" if found else escape_markdown(text)
