"""Figures that compare groups by a mean, its interval, and one point for each policy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.plot_colors import CYCLE, GRAY, RgbColor, color_to_hex

_ROW_HEIGHT, _PANEL_HEIGHT = 0.2, 0.75


@dataclass(frozen=True)
class ComparedMean:
    """One row of a figure.

    Attributes:
        name: What it is.
        values: One value for each policy, shape (P,); NaN for none.
        mean, low, high: Their mean and the ends of its 95 % interval.
        reference: Whether it is what the others are compared with.
    """

    name: str
    values: Floats
    mean: float
    low: float
    high: float
    reference: bool = False


@dataclass(frozen=True)
class ComparisonPanel:
    """Rows on one axis.

    Attributes:
        title, label: Above the rows, and of the axis.
        chance: Where a dashed line says what chance gives; None for none.
        limits: Ends of the axis.
    """

    title: str
    label: str
    rows: Sequence[ComparedMean]
    chance: float | None
    limits: tuple[float, float]


def draw_compared_means(path: Path, title: str, panels: Sequence[ComparisonPanel]) -> None:
    """Draw panels beside each other, with the same rows.

    Raises:
        PictureError: The file cannot be written.
    """
    most = max(len(panel.rows) for panel in panels)
    with open_figure_page(path, _PANEL_HEIGHT + _ROW_HEIGHT * most, title) as figure:
        plots = figure.subplots(1, len(panels), squeeze=False)[0]
        for plot, panel in zip(plots, panels, strict=True):
            _draw_panel(plot, panel)


def _draw_panel(plot: Any, panel: ComparisonPanel) -> None:
    rng = np.random.default_rng(0)
    for place, row in enumerate(panel.rows):
        color = color_to_hex(_color(row))
        known = row.values[np.isfinite(row.values)]
        heights = place + rng.uniform(-0.22, 0.22, len(known))
        plot.plot(known, heights, ".", color=color, alpha=0.35, markersize=3.5, markeredgewidth=0)
        plot.plot([row.low, row.high], [place, place], color=color, linewidth=1.6)
        plot.plot([row.mean], [place], "o", color=color, markersize=4)
    if panel.chance is not None:
        plot.axvline(panel.chance, color=color_to_hex(GRAY), linestyle="--", linewidth=0.8, zorder=0)
    plot.set_yticks(range(len(panel.rows)), [row.name for row in panel.rows])
    plot.set_ylim(len(panel.rows) - 0.4, -0.6)
    plot.set_xlim(*panel.limits)
    plot.set_title(panel.title)
    plot.set_xlabel(panel.label)


def _color(row: ComparedMean) -> RgbColor:
    return CYCLE[1] if row.reference else CYCLE[0]
