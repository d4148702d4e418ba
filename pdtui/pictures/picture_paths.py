"""Where pictures of an experiment are written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pdtui.core.errors import PictureError
from pdtui.pictures.matplotlib_page import FIGURE_SUFFIXES


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
