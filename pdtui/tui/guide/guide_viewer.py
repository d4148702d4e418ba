"""The Markdown viewer of the guide: which links it follows, and how it shows one line of a page."""

from __future__ import annotations

import re

from textual.widgets import Markdown, MarkdownViewer
from textual.widgets.markdown import MarkdownBlock, MarkdownFence

from pdtui.guide.guide_pages import GuidePassage

_LINE = re.compile(r"(.*)#line-(\d+)")


def guide_line_link(passage: GuidePassage) -> str:
    """Return the link to one line of a page, which `GuideViewer.follow` understands."""
    return f"{passage.topic}.md#line-{passage.line}"


class GuideViewer(MarkdownViewer):
    """A Markdown viewer that stays inside the guide: the address of anything else is copied, not opened."""

    @property
    def topic(self) -> str:
        """The page that is shown; empty before the first one."""
        path, _ = Markdown.sanitize_location(str(self.navigator.location))
        return path.stem

    async def follow(self, target: str) -> None:
        """Show what a link leads to: a page, a heading of it or of this page; copy a web address."""
        path, _ = Markdown.sanitize_location(target)
        if "://" in target or path.suffix not in ("", ".md"):
            self.app.copy_to_clipboard(target)
            self.notify(target, title="copied", markup=False)
            return
        self.scroll_home(animate=False)
        line = _LINE.fullmatch(target)
        await self.go(target if line is None else line[1])
        if line is not None:
            self.call_after_refresh(self._show_line, int(line[2]))

    async def _on_markdown_link_clicked(self, message: Markdown.LinkClicked) -> None:
        message.prevent_default()
        message.stop()
        await self.follow(message.href)

    def _show_line(self, line: int) -> None:
        blocks = [
            block
            for block in self.query(MarkdownBlock)
            if block.source_range[0] <= line < block.source_range[1]
        ]
        if not blocks:
            return
        smallest = min(blocks, key=lambda block: block.source_range[1] - block.source_range[0])
        below = line - smallest.source_range[0]
        cells = smallest.query(f".row{below - 1}")  # in a table, beneath the header and its rule
        self.scroll_to_widget(cells.first() if cells else smallest, animate=False, top=True)
        if isinstance(smallest, MarkdownFence):
            self.call_after_refresh(self.scroll_relative, y=below - 1, animate=False)
