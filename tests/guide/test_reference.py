"""The generated pages are up to date, and say what the code says."""

from __future__ import annotations

import dataclasses
import re
from pkgutil import resolve_name

import click
import pytest

from pdtui import api
from pdtui.guide.guide_pages import GUIDE_FOLDER
from pdtui.guide.reference.command_reference import render_command_reference
from pdtui.guide.reference.python_reference import render_python_reference
from pdtui.guide.reference.write_reference import generate_reference_pages


@pytest.mark.parametrize("topic", ["commands", "python"])
def test_the_generated_pages_are_up_to_date(topic: str) -> None:
    stale = "run `python -m pdtui.guide.reference.write_reference`"
    assert (GUIDE_FOLDER / f"{topic}.md").read_text(encoding="utf-8") == generate_reference_pages()[topic], (
        stale
    )


def test_commands_come_from_click() -> None:
    @click.group()
    def program() -> None:
        """A program."""

    @program.command()
    @click.argument("file")
    @click.option("--count", type=int, default=3, show_default=True, help="How often [roughly].")
    def act(file: str, count: int) -> None:
        """Act on FILE,

        and on *nothing* else.
        """

    text = render_command_reference(program, "prog")
    assert "## prog act\n\n```text\nprog act [OPTIONS] FILE\n```\n\nAct on FILE,\n" in text
    assert "and on \\*nothing\\* else.\n" in text
    assert "- `--count INTEGER`: How often \\[roughly\\].  \\[default: 3\\]\n" in text


class Toy:
    """A module of one function."""

    __all__ = ("play",)

    @staticmethod
    def play(ball: str, *, times: int = 2) -> int:
        """Play with a ball.

        >>> 1 + 1
        2

        Args:
            ball: its ``color``,
                or its *name*.
            times: how often.

        Returns:
            The number of throws.

        Raises:
            ValueError: no ball.
        """
        return len(ball) * times


def test_python_comes_from_docstrings() -> None:
    text = render_python_reference(Toy)
    assert (
        "## play\n\n```python\nplay(ball: str, *, times: int = 2) -> int\n```\n\nPlay with a ball.\n" in text
    )
    assert "```pycon\n>>> 1 + 1\n2\n```\n" in text
    assert "**Args**\n\n- `ball`: its `color`, or its \\*name\\*.\n- `times`: how often.\n" in text
    assert "**Returns**\n\nThe number of throws.\n" in text
    assert "**Raises**\n\n- `ValueError`: no ball.\n" in text


def test_the_changelog_names_what_is_there() -> None:
    """The right columns of the tables of renames."""
    text = (GUIDE_FOLDER / "changelog.md").read_text(encoding="utf-8")
    now = [row.split(" | ")[1] for row in text.splitlines() if row.startswith("| `")]
    assert len(now) >= 14
    for names in now:
        first, *others = re.findall(r"`([\w.]+)`", names)
        owner, _, member = first.rpartition(".")
        if owner.startswith("pdtui"):
            resolve_name(first)
        else:
            assert {member, *others} <= {field.name for field in dataclasses.fields(getattr(api, owner))}
