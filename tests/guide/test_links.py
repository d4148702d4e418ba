"""Every link of the README and the guide leads to something that is there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from pdtui.guide.guide_pages import GUIDE_FOLDER, TOPICS
from tests.guide.guide_markdown import CHECKOUT, PAGES, README, anchors, links


def broken_links(page: Path) -> list[str]:
    """Relative links of a page that lead nowhere."""
    broken = []
    for target in links(page):
        if "://" in target or target.startswith("mailto:"):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists() or (anchor and anchor not in anchors(file)):
            broken.append(target)
    return broken


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    assert not broken_links(page)


def test_a_broken_link_is_found(tmp_path: Path) -> None:
    (tmp_path / "b.md").write_text("# Some heading!\n")
    page = tmp_path / "a.md"
    page.write_text("[1](b.md#some-heading) [2](b.md#other) [3](c.md) ![4](d.png) [5](#here)\n\n# Here\n")
    assert broken_links(page) == ["b.md#other", "c.md", "d.png"]


def test_every_page_can_be_reached() -> None:
    assert sorted(TOPICS) == sorted(path.stem for path in GUIDE_FOLDER.glob("*.md"))
    listed = {target.partition("#")[0] for target in links(GUIDE_FOLDER / "index.md")}
    assert listed >= {f"{topic}.md" for topic in TOPICS if topic != "index"}
    site = (CHECKOUT / ".zensical.toml").read_text(encoding="utf-8")
    assert all(f'"{topic}.md"' in site for topic in TOPICS)


def test_the_guide_stays_within_itself() -> None:
    """An installed wheel and the site have no file of the checkout around the guide."""
    for page in set(PAGES) - {README}:
        assert not [target for target in links(page) if target.startswith("..")]


def test_the_readme_is_short() -> None:
    assert len(README.read_text(encoding="utf-8").split()) <= 700


def test_the_guide_names_the_extras_that_there_are() -> None:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    named = set(re.findall(r"(?:pdtui|\.)\[(\w+)\]", text))
    assert named == set(project["optional-dependencies"])
