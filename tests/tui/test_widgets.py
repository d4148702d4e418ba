"""What lies behind the pictures: camera, path, sparklines, heat, numbers."""

from __future__ import annotations

import numpy as np
import pytest
from rich import filesize

from pdtui.core.printable_text import make_printable
from pdtui.core.step_record import ActiveBehavior
from pdtui.driving.drive_snapshot import KeyPress
from pdtui.pictures.perspective_camera import PerspectiveCamera, round_length_down
from pdtui.tui.cell_text import ScreenRow, fit_cells, format_number, format_signed
from pdtui.tui.strip.unit_grid import UnitGrid, allocate_layer_rows, last_first_layer
from pdtui.tui.theme import STYLES
from pdtui.tui.widgets.attribute_history import AttributeHistory
from pdtui.tui.widgets.key_press_axis import KeyPressAxis, key_symbol
from pdtui.tui.widgets.path_trail import MOST_POINTS, PathTrail
from pdtui.tui.widgets.sparklines import draw_line_plots, draw_sparklines, fit_scales, format_range
from pdtui.tui.widgets.unit_table import behaviors_of_units
from tests.tui.recorded_snapshots import drive_map


def test_from_the_side_x_is_right_and_z_is_up() -> None:
    camera = PerspectiveCamera((1.0, 2.0, 0.5), 0.0, 1.0, 10.0, (50.0, 20.0))
    dots, magnification, before = camera.project(
        np.array([[1.0, 2.0, 0.5], [2.0, 2.0, 0.5], [1.0, 2.0, 1.5]])
    )
    assert dots.tolist() == [[50.0, 20.0], [60.0, 20.0], [50.0, 10.0]]
    assert magnification.tolist() == [1.0, 1.0, 1.0]
    assert before.all()


def test_from_above_x_is_right_and_y_is_up() -> None:
    camera = PerspectiveCamera((0.0, 0.0, 0.0), 90.0, 1.0, 10.0, (50.0, 20.0))
    dots, _, _ = camera.project(np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    assert dots.ravel() == pytest.approx([60.0, 20.0, 50.0, 10.0])


def test_what_is_farther_away_is_smaller_and_what_is_behind_is_left_out() -> None:
    camera = PerspectiveCamera((0.0, 0.0, 0.0), 0.0, 1.0, 10.0, (0.0, 0.0))
    dots, magnification, before = camera.project(np.array([[1.0, 6.0, 0.0], [1.0, -7.0, 0.0]]))
    assert magnification[0] == pytest.approx(0.5)
    assert dots[0, 0] == pytest.approx(5.0)
    assert before.tolist() == [True, False]
    assert camera.depth(np.array([0.0, 6.0, 3.0])) == pytest.approx(6.0)


@pytest.mark.parametrize(("length", "rounded"), [(1.0, 1.0), (1.9, 1.0), (2.0, 2.0), (49.0, 20.0)])
def test_round_lengths(length: float, rounded: float) -> None:
    assert round_length_down(length) == pytest.approx(rounded)


def walk(first: int, last: int) -> np.ndarray:
    x = np.arange(first, last) * 0.1
    return np.stack([x, np.zeros_like(x), np.full_like(x, -1.0)], axis=1)


def test_a_long_path_keeps_its_shape_in_few_points() -> None:
    trail = PathTrail()
    done = 0
    for size in [1, 2, 3, 5, 7] * 1500:
        trail.extend(walk(done, done + size), restarted=False)
        done += size
    steps = np.diff(trail.points[:, 0])
    assert MOST_POINTS / 2 - 1 <= len(trail.points) <= MOST_POINTS
    assert steps == pytest.approx(np.full(len(steps), 0.8))
    assert trail.points[0, 0] == 0.0
    assert trail.points[-1, 0] == pytest.approx((done - 1) * 0.1, abs=0.8)


def test_a_restart_begins_a_new_path_and_keeps_the_old_one() -> None:
    trail = PathTrail()
    trail.extend(walk(0, 5), restarted=False)
    trail.extend(walk(100, 103), restarted=True)
    starts, ends, _ = trail.line_segments()
    assert starts[:, 0] == pytest.approx([10.0, 10.1])
    assert ends[:, 0] == pytest.approx([10.1, 10.2])
    assert len(trail.line_segments("past")[0]) == 4


def test_a_jump_is_not_drawn() -> None:
    trail = PathTrail()
    trail.extend(np.array([[0, 0, 0], [0.5, 0, 0], [9, 0, 1], [9.5, 0, 1]], float), restarted=False)
    starts, _, rows = trail.line_segments()
    assert starts[:, 0].tolist() == [0.0, 9.0]
    assert rows.tolist() == [0, 1]


def test_means_fill_from_the_right_and_do_not_shift_within_a_cell() -> None:
    history = AttributeHistory(12, 1)
    history.extend(np.arange(5.0)[:, None])
    means = history.means(3, 2)[:, 0]
    assert means.tolist() == [0.5, 2.5, 4.0]
    history.extend(np.array([[6.0]]))
    assert history.means(3, 2)[:, 0].tolist() == [0.5, 2.5, 5.0]
    assert np.isnan(history.means(5, 2)[:2, 0]).all()


def test_history_forgets_the_oldest_but_not_the_range() -> None:
    history = AttributeHistory(3, 1)
    history.extend(np.array([[-9.0], [1.0], [2.0], [3.0]]))
    assert history.means(3, 1)[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert (history.low[0], history.high[0]) == (-9.0, 3.0)


def test_sparklines() -> None:
    means = np.array([[0.0, 5.0, np.nan], [0.5, 5.0, np.nan], [1.0, 5.0, np.nan]])
    low, high = np.array([0.0, 5.0, np.inf]), np.array([1.0, 5.0, -np.inf])
    lines = draw_sparklines(means, fit_scales(means, low, high))
    assert lines[0] == "▁▅█"
    assert len(set(lines[1])) == 1
    assert lines[2] == "   "


def test_noise_stays_small_beside_what_was_seen() -> None:
    means = np.array([[0.0], [0.001]])
    (line,) = draw_sparklines(means, fit_scales(means, np.array([0.0]), np.array([10.0])))
    assert line in ("▄▄", "▄▅", "▅▅")
    (line,) = draw_sparklines(means, fit_scales(means, np.array([0.0]), np.array([0.001])))
    assert line == "▁█"


def test_few_units_fill_the_strip() -> None:
    grid = UnitGrid(units=4, rows=2, columns=6)
    pixels = grid.spread(np.array([1, 2, 3, 4], np.float32))
    assert pixels.tolist() == [[1, 1, 1, 3, 3, 3], [2, 2, 2, 4, 4, 4]]
    assert [grid.column_of(unit) for unit in range(4)] == [0, 0, 3, 3]


def test_of_many_units_the_strongest_is_seen() -> None:
    grid = UnitGrid(units=8, rows=1, columns=2)
    pixels = grid.spread(np.array([0.1, -0.9, 0.2, 0.3, 0.0, 0.4, -0.1, 0.2], np.float32))
    assert pixels == pytest.approx(np.array([[-0.9, 0.4]]))
    assert [grid.column_of(unit) for unit in (0, 3, 4, 7)] == [0, 0, 1, 1]


@pytest.mark.parametrize("units", [1, 7, 256, 300, 1000])
def test_a_unit_is_where_its_mark_is(units: int) -> None:
    grid = UnitGrid(units, 2, 75)
    for unit in range(0, units, 3):
        values = np.zeros(units, np.float32)
        values[unit] = -1.0
        column = grid.column_of(unit)
        assert (grid.spread(values)[:, column] == -1.0).any()


def test_lines_are_shared_out_between_layers() -> None:
    assert allocate_layer_rows((64, 64), 2) == [(0, 1), (1, 1)]
    assert allocate_layer_rows((64, 64), 8) == [(0, 4), (4, 4)]
    assert allocate_layer_rows((64, 64, 64), 2) == [(0, 1), (1, 1), (2, 0)]
    assert allocate_layer_rows((64, 64, 64), 2, first=1) == [(0, 0), (0, 1), (1, 1)]
    assert allocate_layer_rows((512, 256, 128), 8) == [(0, 4), (4, 2), (6, 2)], "no row is left over"
    assert [last_first_layer((64,) * 3, rows) for rows in (2, 4)] == [1, 0]


@pytest.mark.parametrize(("units", "rows", "columns"), [(5, 1, 76), (5, 4, 76), (256, 2, 76), (300, 1, 76)])
def test_a_pixel_shows_the_units_that_are_drawn_there(units: int, rows: int, columns: int) -> None:
    grid = UnitGrid(units, rows, columns)
    for index in range(units):
        assert index in grid.units_at(grid.row_of(index), grid.column_of(index))
    shown = [unit for row in range(rows) for column in range(columns) for unit in grid.units_at(row, column)]
    assert set(shown) == set(range(units))


def test_the_behavior_latched_last_owns_a_shared_unit() -> None:
    views = [ActiveBehavior("spin left", 3), ActiveBehavior("spin right", 3), ActiveBehavior("heading", None)]
    assert behaviors_of_units(drive_map(), views, (256, 256)) == {12: "spin right", 5: "heading"}
    assert behaviors_of_units(drive_map(), views, (8,)) == {5: "heading"}


@pytest.mark.parametrize(
    ("value", "shown"),
    [(1.234, "1.23"), (-0.001, "0.00"), (-1.5, "−1.50"), (123.45, "123.5"), (54321.0, "54321"), (2e7, "2e7")],
)
def test_numbers_are_short(value: float, shown: str) -> None:
    assert format_number(value) == shown
    assert len(shown) <= 7


def test_signed_numbers() -> None:
    assert [format_signed(1.0), format_signed(-1.0), format_signed(0.0)] == ["+1.00", "−1.00", "+0.00"]


@pytest.mark.parametrize(
    ("count", "shown"), [(0, "0 bytes"), (1499, "1.5 kB"), (2_500_000, "2.5 MB"), (7_100_000_000, "7.1 GB")]
)
def test_sizes(count: int, shown: str) -> None:
    assert filesize.decimal(count) == shown


def test_foreign_text_is_made_harmless() -> None:
    assert make_printable("a\x1b[2Jb\x9b\u202ec\td") == "a\ufffd[2Jb\ufffd\ufffdc d"


def test_text_is_fitted_by_cells() -> None:
    assert fit_cells("abc", 5) == "abc  "
    assert fit_cells("abcdef", 4) == "abc…"
    assert fit_cells("turns on the spot", 9) == "turns on…"
    assert fit_cells("漢字漢字", 5) == "漢字…"
    assert fit_cells("abc", 0) == ""


def test_the_ghosts_values_lie_beside_the_drives_of_the_same_step() -> None:
    history = AttributeHistory(6, 1)
    history.extend(np.arange(8.0)[:, None])
    history.add_ghost(np.array([[40.0], [50.0]]), 6)  # steps 4 and 5
    history.extend(np.array([[8.0]]))
    assert history.means(6, 1)[:, 0].tolist() == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    ghost = history.means(6, 1, ghost=True)[:, 0]
    assert ghost[1:3].tolist() == [40.0, 50.0]
    assert np.isnan(ghost[[0, 3, 4, 5]]).all()
    history.add_ghost(np.arange(100.0)[:, None], 9)  # longer than what is kept
    assert history.means(6, 1, ghost=True)[:, 0].tolist() == [94.0, 95.0, 96.0, 97.0, 98.0, 99.0]
    history.forget_ghost()
    assert np.isnan(history.means(6, 1, ghost=True)).all()


def test_steps_that_a_stopped_screen_has_lost_are_gaps() -> None:
    history = AttributeHistory(6, 1)
    history.extend(np.array([[1.0], [2.0]]), 2)
    history.extend(np.array([[9.0]]), 5)
    assert history.means(5, 1)[[0, 1, 4], 0].tolist() == [1.0, 2.0, 9.0]
    assert np.isnan(history.means(5, 1)[2:4]).all()
    assert history.total == 5


def test_a_key_is_marked_in_the_cell_of_its_step() -> None:
    history = AttributeHistory(12, 1)
    history.extend(np.arange(7.0)[:, None])
    assert [history.cell_of(step, 4, 2) for step in range(7)] == [0, 0, 1, 1, 2, 2, 3]
    marks, line = KeyPressAxis(), ScreenRow(6)
    marks.extend([KeyPress(-90, "x", 0), KeyPress(1, "space", -1), KeyPress(6, "w", 0)])
    marks.draw_axis(line, 4, lambda step: history.cell_of(step, 4, 2))
    assert line.strip().text == "␣──w  "


@pytest.mark.parametrize(
    ("key", "mark"), [("a", "a"), ("space", "␣"), ("plus", "+"), ("up", "↑"), ("f5", "f"), ("ß", "ß")]
)
def test_marks_of_keys(key: str, mark: str) -> None:
    assert key_symbol(key) == mark


def test_plots_have_a_zero_line_only_where_zero_is_inside() -> None:
    values = np.array([[-1.0, 1.0], [1.0, 2.0]])
    scales = fit_scales(values, values.min(axis=0), values.max(axis=0))
    assert scales.crosses_zero.tolist() == [True, False]
    assert (scales.bottom.tolist(), scales.top.tolist()) == ([-1.0, 1.0], [1.0, 2.0])
    means = np.repeat(np.array([[1.0, 1.5]]), 12, axis=0)
    nothing = np.full_like(means, np.nan)
    lines = draw_line_plots(means, nothing, scales, [STYLES.text] * 2)
    texts = [line.text for line in lines]
    assert texts[0] == "⠉" * 6, "the line is at the top"
    assert texts[1] == "⠁⠈ ⠁⠈ ", "zero is in the middle"
    assert [text.strip() for text in texts[2:]] in (["⣀" * 6, ""], ["", "⠉" * 6])


def test_the_ghosts_line_is_dotted_and_in_its_own_color() -> None:
    own, ghost = np.full((8, 1), 1.0), np.full((8, 1), 3.0)
    scales = fit_scales(np.concatenate([own, ghost]), np.array([1.0]), np.array([3.0]))
    above, below = draw_line_plots(own, ghost, scales, [STYLES.primary])
    assert (above.text, below.text) == ("⠁⠁⠁⠁", "⣀⣀⣀⣀")
    assert {segment.style for segment in above} == {STYLES.ghost}
    assert {segment.style for segment in below} == {STYLES.primary}


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        (-0.5, 1.25, "−0.50…1.25"),
        (-80.84, 103.2, "−80.8…103.2"),
        (-1234.0, 5678.0, "−1234…5678"),
        (-1e9, 1e9, ""),
        (float("nan"), 1.0, ""),
    ],
)
def test_ranges_have_the_digits_that_fit(low: float, high: float, said: str) -> None:
    assert format_range(low, high, 11) == said


def test_the_latest_points_of_a_long_path_are_all_kept() -> None:
    trail = PathTrail()
    for first in range(0, 20_000, 50):
        trail.extend(walk(first, first + 50), restarted=False)
    starts, ends, _ = trail.line_segments("recent", 100)
    assert starts[:, 0] == pytest.approx(np.arange(19_899, 19_999) * 0.1)
    assert ends[-1, 0] == pytest.approx(1999.9)
    trail.extend(walk(0, 3), restarted=True)
    assert len(trail.line_segments("recent", 100)[0]) == 2
