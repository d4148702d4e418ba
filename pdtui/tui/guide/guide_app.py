"""The guide in the terminal: pages with links that can be followed, and a search over all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from textual import work
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal
from textual.widgets import OptionList, Static
from textual.widgets.option_list import Option

from pdtui.guide.guide_pages import GUIDE_FOLDER, GuidePage, search_guide
from pdtui.tui.guide.guide_chooser import ChoiceFinder, GuideChoice, GuideChooser
from pdtui.tui.guide.guide_viewer import GuideViewer, line_link
from pdtui.tui.style_sheets import WIDTHS
from pdtui.tui.theme import THEME

GUIDE_STYLE = """
Screen { background: $background; }
#title, #keys { height: 1; background: $surface; padding: 0 1; }
#title { color: $primary; text-style: bold; }
#keys { color: $foreground 60%; }
#pages { display: none; width: 22; height: 1fr; border: none; background: $surface; padding: 1 0; }
.-wide #pages { display: block; }
GuideViewer { background: $background; scrollbar-size-vertical: 1; }
GuideViewer Markdown { padding: 0 2; max-width: 130; }
GuideViewer MarkdownH1 { margin: 1 0; }
GuideChooser { align: center middle; background: $background 60%; }
#chooser {
    width: 96;
    max-width: 100%;
    height: 80%;
    border: round $primary;
    border-title-color: $primary;
    border-title-style: bold;
    border-subtitle-color: $foreground 60%;
    background: $surface;
    padding: 0 1;
}
#query { border: none; border-bottom: solid $foreground 22%; height: 2; padding: 0 1; background: $surface; }
#choices { border: none; height: 1fr; background: $surface; padding: 0; }
"""
_KEYS = "/ search   l links   t contents   b back   [ ] pages   ↑ ↓ scroll   q quit"


class GuideApp(App[None]):
    """Show the guide.

    Args:
        pages: every page, by topic and in reading order.
        topic: the page to begin with.
    """

    CSS = GUIDE_STYLE
    TITLE = "pdtui guide"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = WIDTHS
    BINDINGS: ClassVar = [
        Binding("q", "quit", "leaves the guide", id="guide_quit"),
        Binding("ctrl+c", "quit", "leaves the guide, always", id="guide_quit_always", priority=True),
        Binding("slash", "search", "finds text in all pages", id="guide_search"),
        Binding("l", "links", "lists the links of this page", id="guide_links"),
        Binding("t", "contents", "lists all pages and headings", id="guide_contents"),
        Binding("b,backspace", "back", "goes back to where you were", id="guide_back"),
        Binding("left_square_bracket", "turn_page(-1)", "shows the previous page", id="guide_previous"),
        Binding("right_square_bracket", "turn_page(1)", "shows the next page", id="guide_next"),
    ]

    def __init__(self, pages: Mapping[str, GuidePage], topic: str) -> None:
        super().__init__()
        self._pages, self._first = pages, topic
        self.register_theme(THEME)
        self.theme = THEME.name

    @property
    def page(self) -> GuidePage:
        """The page that is shown."""
        return self._pages[self.query_one(GuideViewer).topic or self._first]

    def compose(self) -> ComposeResult:
        yield Static(id="title", markup=False)
        with Horizontal():
            listed = (Option(page.title, topic) for topic, page in self._pages.items())
            yield OptionList(*listed, id="pages")
            yield GuideViewer(show_table_of_contents=False, open_links=False)
        yield Static(_KEYS, id="keys", markup=False)

    async def on_mount(self) -> None:
        """Show the first page."""
        self.query_one("#pages").can_focus = False
        viewer = self.query_one(GuideViewer)
        viewer.document.focus()
        await viewer.follow(str(GUIDE_FOLDER / f"{self._first}.md"))

    def on_markdown_viewer_navigator_updated(self) -> None:
        """Name the page that is shown."""
        self.query_one("#title", Static).update(f"pdtui guide · {self.page.title}")
        self.query_one("#pages", OptionList).highlighted = list(self._pages).index(self.page.topic)

    async def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Show the page that was clicked in the list."""
        await self.query_one(GuideViewer).follow(f"{event.option_id}.md")

    def action_search(self) -> None:
        """Find text in all pages."""
        self._choose("search the guide", lambda query: _hits(self._pages, query))

    def action_links(self) -> None:
        """Choose a link of this page."""
        links = [GuideChoice(text, target, target) for text, target in self.page.links]
        self._choose(f"links of '{self.page.title}'", lambda query: _filtered(links, query))

    def action_contents(self) -> None:
        """Choose a page or a heading."""
        headings = [
            GuideChoice("  " * (passage.level - 1) + passage.text, "", line_link(passage))
            for page in self._pages.values()
            for passage in page.passages()
            if passage.level
        ]
        self._choose("contents", lambda query: _filtered(headings, query))

    async def action_back(self) -> None:
        """Go back to where the last link was followed."""
        await self.query_one(GuideViewer).back()

    async def action_turn_page(self, change: int) -> None:
        """Show the page before or after this one."""
        topics = list(self._pages)
        place = topics.index(self.page.topic) + change
        if 0 <= place < len(topics):
            await self.query_one(GuideViewer).follow(f"{topics[place]}.md")

    @work
    async def _choose(self, title: str, find: ChoiceFinder) -> None:
        target = await self.push_screen_wait(GuideChooser(title, find))
        if target is not None:
            await self.query_one(GuideViewer).follow(target)


def _hits(pages: Mapping[str, GuidePage], query: str) -> Sequence[GuideChoice]:
    return [
        GuideChoice(hit.text, f"{pages[hit.topic].title} › {hit.heading}", line_link(hit))
        for hit in search_guide(pages, query)
    ]


def _filtered(choices: Sequence[GuideChoice], query: str) -> Sequence[GuideChoice]:
    words = query.lower().split()
    return [choice for choice in choices if all(word in choice.text.lower() for word in words)]
