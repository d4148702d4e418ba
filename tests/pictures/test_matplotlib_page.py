"""Figures are PNG, PDF or SVG by their names."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.errors import PictureError
from pdtui.pictures.matplotlib_page import check_figure_path, open_figure_page


@pytest.mark.parametrize(
    ("name", "start"), [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF-"), ("a.svg", b"<?xml version")]
)
def test_the_name_of_a_figure_says_its_format(name: str, start: bytes, tmp_path: Path) -> None:
    written = []
    for folder in ("one", "other"):
        path = tmp_path / folder / name
        check_figure_path(path, overwrite=False)
        with open_figure_page(path, 2.0, "A line") as figure:
            figure.add_subplot().plot([0.0, 1.0, 4.0])
        written.append(path.read_bytes())
    assert written[0].startswith(start)
    assert b"<svg" in written[0] or not name.endswith("svg")
    assert written[0] == written[1] or name.endswith("svg")  # an SVG has random identifiers


def test_another_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match=r"a\.gif: expected a name that ends in \.png, \.pdf, \.svg"):
        check_figure_path(tmp_path / "a.gif", overwrite=False)
