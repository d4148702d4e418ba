"""The pages of the guide, and the search over all of them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from pdtui.core.errors import PdtuiError

GUIDE_FOLDER = Path(__file__).parent
TOPICS = (
    "index",
    "driving",
    "settings",
    "sessions",
    "maps",
    "interventions",
    "dissecting",
    "evaluating",
    "your-policy",
    "your-world",
    "results",
    "matching-study",
    "shipped-policies",
    "speed",
    "commands",
    "python",
    "contributing",
    "changelog",
)
"""Names of the pages, in reading order."""
_LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)")
_HEADING = re.compile(r"(#{1,6}) +(.+)")
_OWN_LINE = re.compile(r"\s*([|#*-]|\d+\.) ?")
_MARKUP = re.compile(r"\]\([^)]*\)|[*`|\[]+|^\s*#+ ")


@dataclass(frozen=True)
class GuidePassage:
    """A heading, paragraph, list item, table row or line of code.

    Attributes:
        topic: the page's name.
        heading: the heading that it stands under.
        line: its first line in the page, from 0.
        text: its text without markup.
        level: 1 to 6 for a heading, otherwise 0.
    """

    topic: str
    heading: str
    line: int
    text: str
    level: int = 0


@dataclass(frozen=True)
class GuidePage:
    """One page of the guide.

    Attributes:
        topic: its name: the file's name without ``.md``.
        text: its Markdown.
    """

    topic: str
    text: str

    @property
    def title(self) -> str:
        """The first heading."""
        return next(passage.text for passage in self.passages() if passage.level)

    @property
    def links(self) -> list[tuple[str, str]]:
        """Text and target of every link, in the order of the page."""
        return [(_plain(text), target) for text, target in _LINK.findall(self.text)]

    def passages(self) -> Iterator[GuidePassage]:
        """Everything that can be found, in the order of the page."""
        heading, begin, in_code = "", 0, False
        lines: list[str] = []
        for number, line in enumerate([*self.text.splitlines(), ""]):
            fence = line.startswith("```")
            alone = in_code or fence or not line.strip() or _OWN_LINE.match(line) is not None
            if alone and lines:
                yield GuidePassage(self.topic, heading, begin, _plain(" ".join(lines)))
                lines = []
            if fence:
                in_code = not in_code
            elif in_code and line.strip():
                yield GuidePassage(self.topic, heading, number, line.strip())
            elif (found := _HEADING.fullmatch(line)) is not None:
                heading = _plain(found[2])
                yield GuidePassage(self.topic, heading, number, heading, len(found[1]))
            elif line.strip() and not set(line) <= set("|- "):
                begin = begin if lines else number
                lines.append(line.strip())


def read_guide() -> dict[str, GuidePage]:
    """Read every page of the guide, by topic and in reading order."""
    texts = {topic: (GUIDE_FOLDER / f"{topic}.md").read_text(encoding="utf-8") for topic in TOPICS}
    return {topic: GuidePage(topic, text) for topic, text in texts.items()}


def find_guide_page(pages: Mapping[str, GuidePage], topic: str) -> GuidePage:
    """Return the page with this topic; the error for an unknown one lists all topics."""
    if topic not in pages:
        raise PdtuiError(f"no topic '{topic}' in the guide; available: {', '.join(pages)}")
    return pages[topic]


def search_guide(pages: Mapping[str, GuidePage], query: str) -> list[GuidePassage]:
    """Return the passages in which every word of the query occurs, in any case; headings first."""
    words = query.lower().split()
    if not words:
        return []
    found = [
        passage
        for page in pages.values()
        for passage in page.passages()
        if all(word in passage.text.lower() for word in words)
    ]
    return sorted(found, key=lambda passage: not passage.level)


def _plain(markdown: str) -> str:
    return " ".join(_MARKUP.sub(" ", markdown).split())
