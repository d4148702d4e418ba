from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pdtui.core.errors import PictureError
from pdtui.dissection.dissection_result import Dissection
from pdtui.pictures.dissection_figures import draw_dissection_figures, draw_matching_hits, draw_side_effects
from pdtui.pictures.dissection_report import PictureOutputs


@pytest.fixture(scope="module")
def figures(dissection: Dissection, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return draw_dissection_figures(tmp_path_factory.mktemp("figures") / "new", dissection)


def pixels(path: Path) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    with Image.open(path) as image:
        assert image.format == "PNG"
        return np.array(image.convert("RGB"))


def test_sixteen_attributes_take_two_pages_of_each_kind(figures: list[Path]) -> None:
    names = [f"{stem}-{page}" for stem in ("spectrograms", "discrepancies", "effects") for page in (1, 2)]
    assert [path.stem for path in figures] == [*names, "side-effects", "hit-rates"]
    assert sorted(figures[0].parent.iterdir()) == sorted(figures)


def test_figures_are_as_wide_as_a_page_and_drawn_on(figures: list[Path]) -> None:
    for path in figures:
        picture = pixels(path)
        assert picture.shape[1] == 1440, path
        ink = (picture.astype(int).sum(axis=2) < 700).mean(axis=1)
        assert 0.01 < ink.mean() < 0.9, path
        # Nothing but a margin is empty: every eighth of the height has something in it.
        assert all(part.max() > 0 for part in np.array_split(ink, 8)), path


def test_the_same_findings_give_the_same_pixels(
    dissection: Dissection, figures: list[Path], tmp_path: Path
) -> None:
    again = tmp_path / "again.png"
    for other, draw in zip(figures[-2:], (draw_side_effects, draw_matching_hits), strict=True):
        draw(again, dissection)
        np.testing.assert_array_equal(pixels(again), pixels(other))


def test_what_exists_is_kept_unless_asked(
    dissection: Dissection, figures: list[Path], tmp_path: Path
) -> None:
    report = tmp_path / "ant.rrd"
    folder = figures[0].parent
    with pytest.raises(PictureError, match="discrepancies-1.png: already exists; --overwrite replaces it"):
        PictureOutputs(report, folder, overwrite=False).check()
    PictureOutputs(report, folder, overwrite=True).check()
    report.write_bytes(b"kept")
    with pytest.raises(PictureError, match="ant.rrd: already exists; --overwrite replaces it"):
        PictureOutputs(report, None, overwrite=False).check()
    assert report.read_bytes() == b"kept"
    assert PictureOutputs(report, None, overwrite=True).draw(dissection) == [report]
    assert report.read_bytes() != b"kept"


def test_a_report_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="ant.html: expected a name that ends in .rrd"):
        PictureOutputs(tmp_path / "ant.html", None, overwrite=False).check()


def test_the_core_does_not_load_matplotlib() -> None:
    code = "import sys, pdtui.cli, pdtui.pictures.dissection_report; print('matplotlib' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "False"
