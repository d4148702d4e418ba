"""Code, links and anchors of the README and the guide, as a Markdown parser sees them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

from pdtui.guide.guide_pages import GUIDE_FOLDER

CHECKOUT = Path(__file__).parents[2]
README = CHECKOUT / "README.md"
PAGES = [README, *sorted(GUIDE_FOLDER.glob("*.md"))]


@dataclass(frozen=True)
class CodeExample:
    """A block of code, or code within a line, whose language is empty."""

    page: str
    line: int
    language: str
    text: str


def parse(page: Path) -> list[Token]:
    """All tokens of a page, those inside of lines included."""
    tokens = MarkdownIt("gfm-like", {"linkify": False}).parse(page.read_text(encoding="utf-8"))
    return [inner for token in tokens for inner in (token, *(token.children or ()))]


def code_examples(page: Path) -> Iterator[CodeExample]:
    """Every piece of code in a page."""
    line = 0
    for token in parse(page):
        line = token.map[0] + 1 if token.map else line
        if token.type == "fence":
            yield CodeExample(page.name, line, token.info.strip(), token.content)
        elif token.type == "code_inline":
            yield CodeExample(page.name, line, "", token.content)


def links(page: Path) -> Iterator[str]:
    """Targets of all links and pictures of a page."""
    for token in parse(page):
        target = token.attrGet("href") or token.attrGet("src")
        if target is not None:
            yield str(target)


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub and the site give to the headings of a page."""
    tokens = parse(page)
    titles = [after.content for token, after in pairwise(tokens) if token.type == "heading_open"]
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
