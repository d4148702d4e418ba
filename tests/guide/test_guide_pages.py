"""Reading and searching the pages."""

from __future__ import annotations

import pytest

from pdtui.core.errors import PdtuiError
from pdtui.guide.guide_pages import GuidePage, find_guide_page, read_guide, search_guide

PAGE = GuidePage(
    "ants",
    """\
# Ants

An ant is *small*, and
[lives](nests.md#where) in nests.

## Keys

- `a` turns left
- `d` turns right

| key | does |
|---|---|
| `x` | stops |

```sh
# a comment
pdtui drive ant
```
""",
)


def test_passages_are_what_can_be_found() -> None:
    found = [(passage.line, passage.heading, passage.text, passage.level) for passage in PAGE.passages()]
    assert found == [
        (0, "Ants", "Ants", 1),
        (2, "Ants", "An ant is small , and lives in nests.", 0),
        (5, "Keys", "Keys", 2),
        (7, "Keys", "- a turns left", 0),
        (8, "Keys", "- d turns right", 0),
        (10, "Keys", "key does", 0),
        (12, "Keys", "x stops", 0),
        (15, "Keys", "# a comment", 0),
        (16, "Keys", "pdtui drive ant", 0),
    ]
    assert PAGE.title == "Ants"
    assert PAGE.links == [("lives", "nests.md#where")]


def test_search_wants_every_word() -> None:
    pages = {"ants": PAGE}
    assert [hit.line for hit in search_guide(pages, "TURNS")] == [7, 8]
    assert [hit.line for hit in search_guide(pages, "turns right")] == [8]
    assert [hit.text for hit in search_guide(pages, "ant nests small")] == [
        "An ant is small , and lives in nests."
    ]
    assert [hit.level for hit in search_guide(pages, "key")] == [2, 0]  # headings first
    assert search_guide(pages, "elephant") == search_guide(pages, " ") == []


def test_search_looks_at_all_pages() -> None:
    pages = read_guide()
    assert {hit.topic for hit in search_guide(pages, "spectrogram")} >= {"dissecting", "index"}
    assert next(iter(search_guide(pages, "pdtui sessions repair"))).topic == "commands"


def test_an_unknown_topic_lists_the_topics() -> None:
    with pytest.raises(
        PdtuiError, match="no topic 'drvng' in the guide; available: index, driving, .*, changelog$"
    ):
        find_guide_page(read_guide(), "drvng")
