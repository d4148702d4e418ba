"""`pdtui guide`: the documentation, in the terminal or as Markdown."""

from __future__ import annotations

import click

from pdtui.cli.completion.completed_names import complete_topics
from pdtui.cli.screen.show_drive import has_screen, require_settled_theme
from pdtui.core.settings.settings_file import read_settings


@click.command()
@click.argument("topic", default="index", shell_complete=complete_topics)
@click.option("--list", "list_topics", is_flag=True, help="List the topics and exit.")
def guide_command(topic: str, list_topics: bool) -> None:
    """Read the guide, starting with TOPIC.

    In a terminal, links can be followed and all pages searched. Piped, the page is printed as Markdown.
    """
    from pdtui.guide.guide_pages import find_guide_page, read_guide

    pages = read_guide()
    if list_topics:
        width = max(map(len, pages))
        for name, page in pages.items():
            click.echo(f"{name:<{width}}  {page.title}")
        return
    page = find_guide_page(pages, topic)
    if not has_screen():
        click.echo(page.text, nl=False)
        return
    from pdtui.tui.guide.guide_app import GuideApp

    settings = read_settings()
    require_settled_theme(settings)
    GuideApp(pages, topic, settings.theme).run()
