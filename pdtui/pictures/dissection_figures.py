"""The figures of a dissection as PNG files, each as wide as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pdtui.dissection.dissection_result import Dissection
from pdtui.pictures.all_attributes import draw_matching_hits, draw_side_effects
from pdtui.pictures.attribute_figure import draw_effect_key, draw_effects, draw_ranking, draw_spectrograms
from pdtui.pictures.matplotlib_page import figure_page, policy_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_A_PAGE = 8
"""Attributes per page."""
NAMES = ("spectrograms", "discrepancies", "effects", "side-effects", "hit-rates")
"""Stems of the files; figures with one panel per attribute are numbered where one page is not enough."""


def draw_dissection_figures(folder: Path, dissection: Dissection) -> list[Path]:
    """Draw all figures into a folder; files of the same names are replaced.

    Returns:
        The files.

    Raises:
        PictureError: A file cannot be written.
    """
    columns = range(len(dissection.attributes))
    written = _draw_pages(folder, dissection, "spectrograms", columns, _spectrograms)
    written += _draw_pages(folder, dissection, "discrepancies", columns, _discrepancies)
    written += _draw_pages(folder, dissection, "effects", columns, _effects)
    for name, draw in (("side-effects", draw_side_effects), ("hit-rates", draw_matching_hits)):
        written.append(folder / f"{name}.png")
        draw(written[-1], dissection)
    return written


def existing_figures(folder: Path) -> list[Path]:
    """Return the files in a folder that `draw_dissection_figures` may replace."""
    return sorted(
        path for name in NAMES for path in (*folder.glob(f"{name}.png"), *folder.glob(f"{name}-[0-9]*.png"))
    )


@dataclass(frozen=True)
class _Sheet:
    """One page of panels: its file and the attributes on it."""

    path: Path
    columns: tuple[int, ...]


def _draw_pages(
    folder: Path,
    dissection: Dissection,
    stem: str,
    columns: Sequence[int],
    draw: Callable[[_Sheet, Dissection], None],
) -> list[Path]:
    pages = [tuple(columns[first : first + _A_PAGE]) for first in range(0, len(columns), _A_PAGE)]
    sheets = [
        _Sheet(folder / (f"{stem}.png" if len(pages) == 1 else f"{stem}-{number}.png"), few)
        for number, few in enumerate(pages, 1)
    ]
    for sheet in sheets:
        draw(sheet, dissection)
    return [sheet.path for sheet in sheets]


def _grid(figure: Figure, count: int, across: int) -> list[Axes]:
    """Return the panels of a page, row by row; there may be more than `count`."""
    rows = -(-count // across)
    return list(figure.subplots(rows, across, squeeze=False).flat)


def _height(count: int, across: int, row: float) -> float:
    return 0.5 + row * -(-count // across)


def _spectrograms(sheet: _Sheet, dissection: Dissection) -> None:
    count = len(sheet.columns)
    title = f"{policy_title(dissection)}: spectrograms of attributes and of their best matches"
    with figure_page(sheet.path, _height(count, 2, 1.55), title) as figure:
        panels = _grid(figure, 2 * count, 4)
        for number, column in enumerate(sheet.columns):
            draw_spectrograms(figure, panels[2 * number], panels[2 * number + 1], dissection, column)
        _clear(panels[2 * count :])


def _discrepancies(sheet: _Sheet, dissection: Dissection) -> None:
    count, title = len(sheet.columns), f"{policy_title(dissection)}: discrepancy of the nearest units"
    with figure_page(sheet.path, _height(count, 4, 1.9), title) as figure:
        panels = _grid(figure, count, 4)
        for panel, column in zip(panels, sheet.columns, strict=False):
            draw_ranking(panel, dissection, column)
        panels[0].set_ylabel("unit")
        _clear(panels[count:])


def _effects(sheet: _Sheet, dissection: Dissection) -> None:
    count = len(sheet.columns)
    title = f"{policy_title(dissection)}: effect of single units, mean and 95 % interval"
    with figure_page(sheet.path, _height(count, 4, 1.8) + 0.25, title) as figure:
        panels = _grid(figure, count, 4)
        for panel, column in zip(panels, sheet.columns, strict=False):
            draw_effects(panel, dissection, column)
        _clear(panels[count:])
        draw_effect_key(figure)


def _clear(panels: Sequence[Axes]) -> None:
    for panel in panels:
        panel.set_axis_off()
