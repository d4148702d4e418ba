"""Write the guide's moving picture: `python -m pdtui.guide.cast.write_cast [FILE]`."""

from __future__ import annotations

import asyncio
import sys
import tempfile
from pathlib import Path

from pdtui.driving.keystrokes import format_keystrokes
from pdtui.guide.cast.cast_picture import CastPicture
from pdtui.guide.cast.cast_script import SEED, perform_cast
from pdtui.guide.guide_pages import GUIDE_FOLDER
from pdtui.sessions.session_reader import read_session
from pdtui.tui.theme import THEME

TITLE = (
    "Latch a behavior, see it beside its ghost, edit a hidden unit, save it as a key, look back, branch off"
)

KEYS_COMMENT = f"# The keys and edits of the branch: pdtui drive ant --seed {SEED} --headless --keys FILE\n"


def write_cast(path: Path) -> None:
    """Perform the cast, and write it as an SVG file, with the keys of the branch in a file beside it."""
    with tempfile.TemporaryDirectory() as folder:
        cast = asyncio.run(perform_cast(Path(folder)))
        keys = format_keystrokes(read_session(cast.sessions[1]).events)
    picture = CastPicture(cast.frames, THEME.background or "#000000", TITLE).compose()
    path.write_text(picture, encoding="utf-8")
    path.with_suffix(".keys.txt").write_text(KEYS_COMMENT + keys, encoding="utf-8")


if __name__ == "__main__":
    write_cast(Path(sys.argv[1]) if len(sys.argv) > 1 else GUIDE_FOLDER / "images" / "cockpit.svg")
