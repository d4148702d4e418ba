"""What a screen shows, as text."""

from __future__ import annotations

from textual.app import App
from textual.pilot import Pilot
from textual.widget import Widget

from tests.tui.conftest import ScriptedConnection


async def played(pilot: Pilot[str], connection: ScriptedConnection) -> None:
    """Wait until the application has drawn everything that its connection had to say."""
    for _ in range(2000):
        if not connection.messages:
            break
        await pilot.pause(0.005)
    assert not connection.messages
    await pilot.pause(0.02)


def shown(widget: Widget) -> str:
    """The text of a widget, frame and all."""
    size = widget.outer_size
    return "\n".join(strip.text for strip in widget.render_lines(size.region))


def notice(app: App[str]) -> str:
    """The text of the notice line."""
    return shown(app.query_one("#notice"))
