"""The guide on the screen: links, search, contents, back, quit."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from textual.pilot import Pilot
from textual.widgets import Input, Markdown, OptionList, Static

from pdtui.guide.guide_pages import read_guide
from pdtui.tui.guide.guide_app import GuideApp
from pdtui.tui.guide.guide_viewer import GuideViewer


async def happens(pilot: Pilot[None], condition: Callable[[], bool]) -> bool:
    """Let the app work until a condition holds; a page is read, laid out and scrolled in several turns."""
    for _ in range(200):
        if condition():
            return True
        await pilot.pause()
    return False


async def shows(pilot: Pilot[None], app: GuideApp, topic: str) -> bool:
    """Wait until a page is shown, with its title and its text, and no list over it."""
    page = read_guide()[topic]

    def shown() -> bool:
        if len(app.screen_stack) > 1 or app.query_one(Markdown).source != page.text:
            return False
        return app.query_one("#title", Static).content == f"pdtui guide · {page.title}"

    return await happens(pilot, shown) and app.page.topic == topic


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
async def test_links_are_followed_and_left_again(size: tuple[int, int]) -> None:
    app = GuideApp(read_guide(), "driving")
    async with app.run_test(size=size) as pilot:
        assert await shows(pilot, app, "driving")
        assert app.query_one("#pages").display == (size[0] > 110)
        await pilot.press("l", *"dissecting", "enter")
        assert await shows(pilot, app, "dissecting")
        await app.query_one(GuideViewer).follow("speed.md#recording")
        assert await shows(pilot, app, "speed")
        assert await happens(pilot, lambda: app.query_one(GuideViewer).scroll_y > 0)
        await pilot.press("b")
        assert await shows(pilot, app, "dissecting")
        await pilot.press("b")
        assert await shows(pilot, app, "driving")


async def test_a_link_to_the_web_is_copied() -> None:
    app = GuideApp(read_guide(), "sessions")
    async with app.run_test(size=(80, 24)) as pilot:
        await app.query_one(GuideViewer).follow("https://rerun.io")
        await pilot.pause()
        assert app.clipboard == "https://rerun.io"
        assert await shows(pilot, app, "sessions")


async def test_search_finds_text_in_another_page() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("slash")
        await pilot.pause()
        app.screen.query_one(Input).value = "9412 refused"
        await pilot.pause()
        assert app.screen.query_one(OptionList).option_count == 1
        await pilot.press("enter")
        assert await shows(pilot, app, "speed")
        assert await happens(pilot, lambda: app.query_one(GuideViewer).scroll_y > 10)


@pytest.mark.parametrize(
    ("query", "text"), [("limit = 2.0", "limit = 2.0"), ("falls in roll-outs", "falls in of")]
)
async def test_a_line_of_code_and_a_row_of_a_table_are_shown(query: str, text: str) -> None:
    """Not only the block that they are in, which may be longer than the screen."""
    app = GuideApp(read_guide(), "maps")
    async with app.run_test(size=(80, 16)) as pilot:
        await pilot.press("slash")
        await pilot.pause()
        app.screen.query_one(Input).value = query
        await pilot.pause()
        await pilot.press("enter")
        assert await shows(pilot, app, "maps")

        def lines() -> str:
            return "\n".join(strip.text for strip in app.screen._compositor.render_strips())

        assert await happens(pilot, lambda: text in lines())


async def test_a_search_without_a_hit_goes_nowhere() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("slash", *"elephant", "enter")
        await pilot.pause()
        await pilot.press("escape")
        assert await shows(pilot, app, "index")


async def test_contents_and_pages() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("t", *"holding a target", "enter")
        assert await shows(pilot, app, "maps")
        await pilot.press("right_square_bracket")
        assert await shows(pilot, app, "interventions")
        await pilot.press("left_square_bracket", "left_square_bracket")
        assert await shows(pilot, app, "sessions")


async def test_q_leaves() -> None:
    app = GuideApp(read_guide(), "index")
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("q")
    assert app.return_code == 0
    assert not app.is_running
