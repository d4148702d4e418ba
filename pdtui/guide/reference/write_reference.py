"""Write the generated pages of the guide: `python -m pdtui.guide.reference.write_reference`."""

from __future__ import annotations

from pdtui import api
from pdtui.cli import main
from pdtui.dissection.dissection_config import DissectionConfig
from pdtui.driving.replays.replay_result import ReplayResult
from pdtui.guide.guide_pages import GUIDE_FOLDER
from pdtui.guide.reference.command_reference import render_command_reference
from pdtui.guide.reference.python_reference import render_python_reference


def generate_reference_pages() -> dict[str, str]:
    """Return the text of the generated pages, by topic."""
    return {
        "commands": render_command_reference(main, "pdtui"),
        "python": render_python_reference(api, DissectionConfig, ReplayResult),
    }


if __name__ == "__main__":
    for topic, text in generate_reference_pages().items():
        (GUIDE_FOLDER / f"{topic}.md").write_text(text, encoding="utf-8")
