"""The figures of a dissection as PNG, PDF or SVG files, each as wide as a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarize_dissection
from pdtui.pictures.dissection_attribute_plots import (
    draw_effect_key,
    draw_effects,
    draw_ranking,
    draw_spectrograms,
)
from pdtui.pictures.dissection_chart_data import side_effect_matrix
from pdtui.pictures.matplotlib_page import format_policy_title, open_figure_page
from pdtui.pictures.plot_colors import GRAY, GREEN, VERMILLION, color_to_hex, diverging_colors
from pdtui.probing.matching_hits import TOP_MATCHES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MATCHED, _PROBED, _FAINT = color_to_hex(VERMILLION), color_to_hex(GREEN), color_to_hex(GRAY)
_A_PAGE = 8
"""Attributes per page."""
NAMES = ("spectrograms", "discrepancies", "effects", "side-effects", "hit-rates")
"""Stems of the files; figures with one panel per attribute are numbered where one page is not enough."""


def draw_dissection_figures(folder: Path, dissection: Dissection, kind: str = "png") -> list[Path]:
    """Draw all figures into a folder, replace files of the same names, and return the files.

    Args:
        folder: The folder.
        dissection: What to draw.
        kind: Format of the files: ``png``, ``pdf`` or ``svg``.

    Raises:
        PictureError: A file cannot be written.
    """
    columns, written = range(len(dissection.attributes)), list[Path]()
    pages = [columns[first : first + _A_PAGE] for first in range(0, len(columns), _A_PAGE)]
    for name, draw_page in zip(NAMES, (_draw_spectrograms, _draw_rankings, _draw_effects), strict=False):
        for number, page in enumerate(pages, start=1):
            written.append(folder / (f"{name}.{kind}" if len(pages) == 1 else f"{name}-{number}.{kind}"))
            draw_page(written[-1], dissection, page)
    for name, draw in (("side-effects", draw_side_effects), ("hit-rates", draw_matching_hits)):
        written.append(folder / f"{name}.{kind}")
        draw(written[-1], dissection)
    return written


def existing_figures(folder: Path, kind: str = "png") -> list[Path]:
    """Return the files in a folder that `draw_dissection_figures` may replace."""
    ends = ("", "-[0-9]*")
    return sorted(path for name in NAMES for end in ends for path in folder.glob(f"{name}{end}.{kind}"))


@contextmanager
def _panel_page(
    path: Path, count: int, row_height: float, title: str, margin: float = 0.5
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a page and its panels, four in a row."""
    rows = -(-count // 4)
    with open_figure_page(path, margin + row_height * rows, title) as figure:
        panels = list(figure.subplots(rows, 4, squeeze=False).flat)
        for panel in panels[count:]:
            panel.set_axis_off()
        yield figure, panels[:count]


def _draw_spectrograms(path: Path, dissection: Dissection, columns: Sequence[int]) -> None:
    title = f"{format_policy_title(dissection)}: spectrograms of attributes and of their best matches"
    with _panel_page(path, 2 * len(columns), 1.55, title) as (figure, panels):
        for column, left, right in zip(columns, panels[::2], panels[1::2], strict=True):
            draw_spectrograms(figure, left, right, dissection, column)


def _draw_rankings(path: Path, dissection: Dissection, columns: Sequence[int]) -> None:
    title = f"{format_policy_title(dissection)}: discrepancy of the nearest units"
    with _panel_page(path, len(columns), 1.9, title) as (_, panels):
        for panel, column in zip(panels, columns, strict=True):
            draw_ranking(panel, dissection, column)
        panels[0].set_ylabel("unit")


def _draw_effects(path: Path, dissection: Dissection, columns: Sequence[int]) -> None:
    title = f"{format_policy_title(dissection)}: effect of single units, mean and 95 % interval"
    with _panel_page(path, len(columns), 1.8, title, margin=0.75) as (figure, panels):
        for panel, column in zip(panels, columns, strict=True):
            draw_effects(panel, dissection, column)
        draw_effect_key(figure)


def draw_side_effects(target: Path | BytesIO, dissection: Dissection) -> None:
    """Draw units × attributes as a heat map for each sign of the output."""
    effects = side_effect_matrix(dissection)
    title = f"{format_policy_title(dissection)}: side effects of single units"
    rows = max(1, len(effects.by_value))
    with open_figure_page(target, 0.6 + rows * (0.6 + 0.155 * len(effects.attributes)), title) as figure:
        panels = list(figure.subplots(rows, 1, squeeze=False).flat)
        for panel, (value, matrix) in zip(panels, effects.by_value.items(), strict=False):
            panel.imshow(diverging_colors(matrix.T, effects.limit), aspect="auto", interpolation="nearest")
            panel.set_title(f"output held at v = {value:g}")
            panel.set_yticks(range(len(effects.attributes)), effects.attributes)
            panel.set_xticks(range(len(effects.units)), effects.units, rotation=90)
            panel.tick_params(axis="x", labelsize=min(7.0, 420.0 / max(1, len(effects.units))))
            panel.set_xlabel("unit")
        _colorbar(figure, panels, effects.limit)


def _colorbar(figure: Figure, panels: Sequence[Axes], limit: float) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    shades = diverging_colors(np.linspace(-limit, limit, 201), limit) / 255
    mappable = ScalarMappable(Normalize(-limit, limit), ListedColormap(shades))
    bar = figure.colorbar(mappable, ax=list(panels), aspect=40, pad=0.015, extend="both")
    bar.set_label("change, in standard deviations of the attribute")


def draw_matching_hits(target: Path | BytesIO, dissection: Dissection) -> None:
    """Draw how well matching finds the units that probing finds, one row per attribute."""
    attributes = summarize_dissection(dissection)["attributes"]
    names = [attribute["name"] for attribute in attributes]

    def column(key: str) -> Floats:
        """Return a figure of all attributes; NaN where there is none."""
        return np.array([attribute["hits"][key] for attribute in attributes], np.float64)

    places = np.arange(len(names))
    title = f"{format_policy_title(dissection)}: how well matching finds units that act"
    with open_figure_page(target, 1.1 + 0.19 * len(names), title) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        width = 0.8 / (1 + len(TOP_MATCHES))
        shades = ("#c85200", "#ff9a4d", "#ffc79b")
        bars = [("first", "first match"), *((f"best_{one}", f"first {one} matches") for one in TOP_MATCHES)]
        for number, (key, label) in enumerate(bars):
            offset = (number - len(TOP_MATCHES) / 2) * width
            left.barh(places + offset, 100 * column(key), width, color=shades[number], label=label)
        left.plot(
            100 * column("random"), places, "|", color="black", markersize=9, label="a unit drawn at random"
        )
        left.set(xlabel="hits (%)", xlim=(0, 102), title="Share among the strongest tenth")
        left.set_yticks(places, names)
        left.invert_yaxis()
        for key, label, color, marker in (
            ("held_out_matching", "ranked by matching", _MATCHED, "o"),
            ("held_out_probing", "ranked by probing", _PROBED, "s"),
        ):
            right.plot(column(key), places, marker, color=color, markersize=4, label=label)
        right.plot(
            column("ceiling"), places, "|", color="black", markersize=9, label="noise ceiling of probing"
        )
        right.axvline(0, color=_FAINT, linewidth=0.6)
        right.set(xlabel="rank correlation with the effect on other starts", xlim=(-1.05, 1.05))
        right.set_title(f"Held out: {len(dissection.judgment.controls)} units drawn at random")
        for panel in (left, right):
            panel.grid(axis="y", linewidth=0.3, alpha=0.5)
            panel.set_axisbelow(True)
            panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)
