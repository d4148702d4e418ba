"""The guide on the screen: links, search, contents, back, quit."""

from __future__ import annotations

import pytest
from textual.pilot import Pilot
from textual.widgets import Input, Markdown, OptionList, Static

from pdtui.guide.guide_pages import read_guide
from pdtui.tui.guide.guide_app import GuideApp
from pdtui.tui.guide.guide_viewer import GuideViewer


def shown(app: GuideApp) -> str:
    """The topic of the page that is shown; title, list and text have to agree."""
    page = app.page
    assert app.query_one("#title", Static).content == f"pdtui guide · {page.title}"
    assert app.query_one(Markdown).source == page.text
    return page.topic


async def settle(pilot: Pilot[None]) -> None:
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
async def test_links_are_followed_and_left_again(size: tuple[int, int]) -> None:
    app = GuideApp(read_guide(), "driving")
    async with app.run_test(size=size) as pilot:
        assert shown(app) == "driving"
        assert app.query_one("#pages").display == (size[0] > 110)
        await pilot.press("l", *"dissecting", "enter")
        await settle(pilot)
        assert shown(app) == "dissecting"
        await app.query_one(GuideViewer).follow("speed.md#recording")
        await pilot.pause()
        assert shown(app) == "speed"
        assert app.query_one(GuideViewer).scroll_y > 0
        await pilot.press("b")
        await pilot.pause()
        assert shown(app) == "dissecting"
        await pilot.press("b")
        await pilot.pause()
        assert shown(app) == "driving"


async def test_a_link_to_the_web_is_copied() -> None:
    app = GuideApp(read_guide(), "sessions")
    async with app.run_test(size=(80, 24)) as pilot:
        await app.query_one(GuideViewer).follow("https://rerun.io")
        await pilot.pause()
        assert app.clipboard == "https://rerun.io"
        assert shown(app) == "sessions"


async def test_search_finds_text_in_another_page() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("slash")
        await pilot.pause()
        app.screen.query_one(Input).value = "9412 refused"
        await pilot.pause()
        assert app.screen.query_one(OptionList).option_count == 1
        await pilot.press("enter")
        await settle(pilot)
        assert shown(app) == "speed"
        assert app.query_one(GuideViewer).scroll_y > 10


async def test_a_search_without_a_hit_goes_nowhere() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("slash", *"elephant", "enter")
        await pilot.pause()
        await pilot.press("escape")
        await settle(pilot)
        assert shown(app) == "index"


async def test_contents_and_pages() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("t", *"holding a target", "enter")
        await settle(pilot)
        assert shown(app) == "maps"
        await pilot.press("right_square_bracket")
        await pilot.pause()
        assert shown(app) == "dissecting"
        await pilot.press("left_square_bracket", "left_square_bracket")
        await pilot.pause()
        assert shown(app) == "sessions"


async def test_q_leaves() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("q")
    assert app.return_code == 0
    assert not app.is_running
