"""Ways on roads from above: their pieces, the corners of boxes, and both formats."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdtui.core.errors import PictureError
from pdtui.pictures.picture_paths import check_picture_paths
from pdtui.pictures.plot_colors import GRAY
from pdtui.pictures.road_pictures import RoadPicture, behavior_colors, box_corners, draw_road_pictures

WAY = np.stack([np.arange(6.0), np.zeros(6)], axis=1)
PICTURE = RoadPicture(
    "test-3: alone: crashed; shared: arrived",
    (np.array([[0.0, 4.0], [9.0, 4.0]]), np.array([[0.0, -4.0], [9.0, -4.0]])),
    np.array([[5.0, 2.0, math.pi / 2, 4.0, 2.0]]),
    (WAY + 1.0,),
    WAY[:3],
    WAY,
    ("", "", "brake", "brake", "", "lane left"),
)


def test_pieces_of_a_way_have_one_behavior_each_and_meet() -> None:
    pieces = list(PICTURE.pieces())
    assert [name for name, _ in pieces] == ["", "brake", "", "lane left"]
    assert [piece[:, 0].tolist() for _, piece in pieces] == [[0, 1], [1, 2, 3], [3, 4], [4, 5]]


def test_a_box_that_is_turned_lies_across() -> None:
    corners = box_corners(PICTURE.boxes)
    assert corners.shape == (1, 4, 2)
    np.testing.assert_allclose(np.ptp(corners[0], axis=0), [2.0, 4.0])
    np.testing.assert_allclose(corners[0].mean(axis=0), [5.0, 2.0])


def test_each_behavior_has_a_color_of_its_own() -> None:
    colors = behavior_colors([PICTURE, replace(PICTURE, behaviors=("operator",) * 6)])
    assert list(colors) == ["", "brake", "lane left", "operator"]
    assert colors[""] == GRAY
    assert len(set(colors.values())) == 4


def test_both_formats_are_written(tmp_path: Path) -> None:
    paths = tmp_path / "ways.png", tmp_path / "ways.rrd"
    check_picture_paths(paths, overwrite=False)
    draw_road_pictures(paths, "metadrive", [PICTURE] * 3)
    assert paths[0].read_bytes().startswith(b"\x89PNG")
    assert paths[1].read_bytes().startswith(b"RRF2")
    with pytest.raises(PictureError, match=r"ways\.png: already exists"):
        check_picture_paths(paths, overwrite=False)
    with pytest.raises(PictureError, match=r"ways\.gif: expected a name that ends in"):
        check_picture_paths([tmp_path / "ways.gif"], overwrite=False)
