"""The guide in the terminal: pages with links that can be followed, and a search over all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import ClassVar

from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal
from textual.screen import ModalScreen
from textual.widgets import OptionList, Static
from textual.widgets.option_list import Option

from pdtui.guide.guide_pages import GUIDE_FOLDER, GuidePage, search_guide
from pdtui.tui.choice_list import ChoiceList, ListChoice, has_all_words
from pdtui.tui.guide.guide_viewer import GuideViewer, guide_line_link
from pdtui.tui.style_sheets import WIDTHS
from pdtui.tui.theme import STYLES, THEME
from pdtui.tui.themes.themed_app import ThemedApp

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
GuideChooser ChoiceList { width: 96; height: 80%; }
"""
_KEYS = "/ search   l links   t contents   b back   [ ] pages   ↑ ↓ scroll   q quit"


class GuideApp(ThemedApp[None]):
    """Shows all pages, which are given by topic and in reading order, beginning with one topic."""

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

    def __init__(self, pages: Mapping[str, GuidePage], topic: str, theme: str = THEME.name) -> None:
        super().__init__(theme)
        self._pages, self._first = pages, topic

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
        self.query_one("#pages").can_focus = False
        viewer = self.query_one(GuideViewer)
        viewer.document.focus()
        await viewer.follow(str(GUIDE_FOLDER / f"{self._first}.md"))

    def on_markdown_viewer_navigator_updated(self) -> None:
        self.query_one("#title", Static).update(f"pdtui guide · {self.page.title}")
        self.query_one("#pages", OptionList).highlighted = list(self._pages).index(self.page.topic)

    async def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        await self.query_one(GuideViewer).follow(f"{event.option_id}.md")

    def action_search(self) -> None:
        """Find text in all pages."""
        self._choose(
            "search the guide",
            lambda query: (
                _choice(hit.text, f"{self._pages[hit.topic].title} › {hit.heading}", guide_line_link(hit))
                for hit in search_guide(self._pages, query)
            ),
        )

    def action_links(self) -> None:
        """Choose a link of this page."""
        links = [(text, target, target) for text, target in self.page.links]
        self._choose_among(f"links of '{self.page.title}'", links)

    def action_contents(self) -> None:
        """Choose a page or a heading."""
        headings = [
            ("  " * (passage.level - 1) + passage.text, "", guide_line_link(passage))
            for page in self._pages.values()
            for passage in page.passages()
            if passage.level
        ]
        self._choose_among("contents", headings)

    def _choose_among(self, title: str, links: Sequence[tuple[str, str, str]]) -> None:
        """Offer links, each a text, the place that it leads to, and the target."""
        self._choose(title, lambda query: (_choice(*link) for link in links if has_all_words(link[0], query)))

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
    async def _choose(self, title: str, find_choices: Callable[[str], Iterable[ListChoice]]) -> None:
        target = await self.push_screen_wait(GuideChooser(title, find_choices))
        if target is not None:
            await self.query_one(GuideViewer).follow(target)


class GuideChooser(ModalScreen[str | None]):
    """The overlay in which text, a link or a heading is chosen; the result is a link, or None."""

    BINDINGS: ClassVar = [Binding("escape", "dismiss(None)", "closes the list", id="guide_close")]

    def __init__(self, title: str, find_choices: Callable[[str], Iterable[ListChoice]]) -> None:
        super().__init__()
        self._title, self._find_choices = title, find_choices

    def compose(self) -> ComposeResult:
        yield ChoiceList(
            self._title,
            "↑ ↓ choose   ↵ go there   type to filter   esc close",
            "words to find",
            self._find_choices,
            nothing_found="nothing has all of these words",
        )

    def on_choice_list_chosen(self, event: ChoiceList.Chosen) -> None:
        self.dismiss(event.value)


def _choice(text: str, place: str, target: str) -> ListChoice:
    """Return the choice of a link; the place, which may be empty, is its second line."""
    prompt = Text(text, STYLES.text, no_wrap=True, overflow="ellipsis")
    if place:
        prompt.append(f"\n  {place}", STYLES.muted)
    return ListChoice(prompt, target)
