"""Where pictures of an experiment are written, and in which format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from pdtui.core.errors import PictureError
from pdtui.pictures.matplotlib_page import FIGURE_SUFFIXES

Shown = TypeVar("Shown")


def check_picture_paths(paths: Sequence[Path], overwrite: bool) -> None:
    """Find out before minutes of work whether the pictures can be written.

    Raises:
        PictureError: The ending is unknown, or a file already exists.
    """
    for path in paths:
        if path.suffix not in (*FIGURE_SUFFIXES, ".rrd"):
            raise PictureError(f"{path}: expected a name that ends in {', '.join(FIGURE_SUFFIXES)} or .rrd")
        if path.exists() and not overwrite:
            raise PictureError(f"{path}: already exists; --overwrite replaces it")


def write_pictures(
    paths: Sequence[Path],
    shown: Shown,
    draw_figure: Callable[[Path, Shown], None],
    write_recording: Callable[[Path, Shown], None],
) -> None:
    """Write every picture in the format that the ending of its name says.

    Raises:
        PictureError: A file cannot be written.
    """
    for path in paths:
        (draw_figure if path.suffix in FIGURE_SUFFIXES else write_recording)(path, shown)
