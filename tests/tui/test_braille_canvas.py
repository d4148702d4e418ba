"""The braille canvas, against dots counted by hand."""

from __future__ import annotations

import numpy as np
import pytest
from rich.style import Style

from pdtui.tui.braille_canvas import BrailleCanvas


def text_of(canvas: BrailleCanvas) -> list[str]:
    styles = [Style()] * 8
    return [strip.text for strip in canvas.render_strips(styles)]


@pytest.mark.parametrize(
    ("x", "y", "character"), [(0, 0, "⠁"), (1, 0, "⠈"), (0, 1, "⠂"), (1, 2, "⠠"), (0, 3, "⡀"), (1, 3, "⢀")]
)
def test_each_dot_of_a_cell(x: int, y: int, character: str) -> None:
    canvas = BrailleCanvas(1, 1)
    canvas.draw_points(np.array([x + 0.5]), np.array([y + 0.5]), 0)
    assert text_of(canvas) == [character]


def test_an_empty_canvas_is_blank() -> None:
    assert text_of(BrailleCanvas(3, 2)) == ["   ", "   "]


def test_points_outside_are_cut_off() -> None:
    canvas = BrailleCanvas(2, 1)
    canvas.draw_points(np.array([-0.1, 4.0, 1.0]), np.array([1.0, 1.0, 4.0]), 0)
    assert not canvas.dots.any()


def test_a_diagonal_line() -> None:
    canvas = BrailleCanvas(2, 1)
    canvas.draw_segments(np.array([[0.5, 0.5]]), np.array([[3.5, 3.5]]), 0)
    assert text_of(canvas) == ["⠑⢄"]


def test_lines_far_outside_or_endless_are_left_out() -> None:
    canvas = BrailleCanvas(2, 1)
    starts = np.array([[-9.0, 1.0], [0.0, 0.0], [1.0, 1.0]])
    ends = np.array([[-5.0, 1.0], [1e12, 1e12], [np.nan, 1.0]])
    canvas.draw_segments(starts, ends, 0)
    assert not canvas.dots.any()


def test_a_disc_has_the_area_of_its_radius() -> None:
    canvas = BrailleCanvas(20, 10)
    center = np.array([20.0, 20.0])
    canvas.draw_capsule(center, center, 10.0, 1)
    assert canvas.dots.sum() == pytest.approx(np.pi * 100, rel=0.03)
    rows, columns = np.nonzero(canvas.dots)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (10, 29, 10, 29)


def test_a_capsule_is_a_band_with_round_ends() -> None:
    canvas = BrailleCanvas(20, 10)
    canvas.draw_capsule(np.array([10.0, 20.0]), np.array([30.0, 20.0]), 4.0, 1)
    assert canvas.dots.sum() == pytest.approx(20 * 8 + np.pi * 16, rel=0.05)


def test_a_rim_parts_a_near_limb_from_a_far_one() -> None:
    canvas = BrailleCanvas(10, 5)
    canvas.dots[:] = True
    canvas.draw_capsule(np.array([10.0, -5.0]), np.array([10.0, 30.0]), 2.0, 1, halo=2.0)
    assert canvas.dots[10].tolist() == [True] * 6 + [False] * 2 + [True] * 4 + [False] * 2 + [True] * 6


def test_the_last_ink_of_a_cell_wins_and_blanks_join_their_left() -> None:
    canvas = BrailleCanvas(4, 1)
    canvas.draw_points(np.array([0.5, 1.5, 6.5]), np.array([0.5, 0.5, 0.5]), np.array([1, 2, 3], np.int16))
    styles = [Style(color=f"color({n})") for n in range(4)]
    (strip,) = canvas.render_strips(styles)
    assert [(segment.text, segment.style) for segment in strip] == [("⠉  ", styles[2]), ("⠁", styles[3])]


def test_text_is_cut_at_both_edges() -> None:
    canvas = BrailleCanvas(4, 2)
    canvas.draw_text(-2, 0, "abcd", 0)
    canvas.draw_text(3, 1, "xyz", 0)
    canvas.draw_text(0, 2, "below", 0)
    assert text_of(canvas) == ["cd  ", "   x"]


@pytest.mark.parametrize("order", [1, -1])
def test_a_polygon_is_filled_and_has_a_rim(order: int) -> None:
    canvas = BrailleCanvas(6, 3)
    canvas.dots[:] = True
    corners = np.array([[3.0, 3.0], [8.0, 3.0], [8.0, 8.0], [3.0, 8.0]])[::order]
    canvas.draw_polygon(corners, 1, halo=1.0)
    expected = np.ones((12, 12), bool)
    expected[2:9, 2:9] = False
    expected[3:8, 3:8] = True
    np.testing.assert_array_equal(canvas.dots, expected)


def test_the_thinnest_polygon_is_still_seen() -> None:
    canvas = BrailleCanvas(2, 1)
    canvas.draw_polygon(np.array([[0.6, 1.6], [3.4, 1.6], [3.4, 1.7], [0.6, 1.7]]), 0)
    assert text_of(canvas) == ["⠒⠒"]


@pytest.mark.parametrize("offset", [100.0, 1e300, np.nan, np.inf])
def test_a_polygon_elsewhere_is_not_drawn(offset: float) -> None:
    canvas = BrailleCanvas(2, 1)
    canvas.draw_polygon(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]) + offset, 0)
    assert not canvas.dots.any()
