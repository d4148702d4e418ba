"""Where files that a map or a session names may lie. Loads no heavy library."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from pdtui.core.errors import PolicyError

FOLDERS = "PDTUI_POLICY_FOLDERS"
"""Environment variable: folders in which maps and sessions may name files, separated as in PATH."""


def find_beside(name: str, folders: Sequence[Path]) -> Path | None:
    """A file by its path from the working directory, or else from one of the folders."""
    places = (Path(name), *(folder / name for folder in folders))
    return next((path for path in places if _is_file(path)), None)


def find_inside(name: str, folders: Sequence[Path], source: str) -> Path | None:
    """As `find_beside`, for a name that a map or a session gives: nothing outside the folders is looked at.

    Those are the working directory, the folders given, and those of the environment variable `FOLDERS`. What
    a link points to counts, not where it lies.

    Args:
        name: of a file.
        folders: where it may lie beside the working directory.
        source: what names it, for the message.

    Raises:
        PolicyError: the name leads out of them.
    """
    allowed = [Path.cwd(), *folders, *map(Path, filter(None, os.environ.get(FOLDERS, "").split(os.pathsep)))]
    inside = [folder.resolve() for folder in allowed]
    outside = False
    for path in (Path(name), *(folder / name for folder in folders)):
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):  # too long, a circle of links, or no name at all
            continue
        if not any(real.is_relative_to(folder) for folder in inside):
            outside = True
        elif _is_file(path):
            return path
    if outside:
        raise PolicyError(
            f"{source}: names the file '{name}', which lies outside of its folder and of the working "
            f"directory; name it on the command line (--policy, --normaliser), or its folder in {FOLDERS}"
        )
    return None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long
        return False
