"""``--fps`` and ``--theme``, which override the user's settings for one command."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Any

import click

from pdtui.core.settings.settings_file import read_settings
from pdtui.core.settings.user_settings import MOST_FPS


def screen_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--fps`` and ``--theme``; the command gets the settings with them as `settings`."""

    @click.option(
        "--fps",
        type=click.IntRange(1, MOST_FPS),
        metavar="N",
        help="Number of frames per second on the screen; default: that of `pdtui config`, 12.",
    )
    @click.option(
        "--theme", metavar="NAME", help="Theme of the screen; default: that of `pdtui config`, pdtui."
    )
    @wraps(command)
    def with_settings(*args: Any, fps: int | None, theme: str | None, **others: Any) -> Any:
        settings = read_settings()
        settings = replace(settings, fps=fps or settings.fps, theme=theme or settings.theme)
        return command(*args, settings=settings, **others)

    return with_settings
