"""The figures of a dissection, each a PNG of a page's width."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pdtui.dissection.dissection_result import Dissection
from pdtui.pictures.all_attributes import draw_matching_hits, draw_side_effects
from pdtui.pictures.chart_data import (
    EffectCurve,
    MatchedPair,
    SpectrogramChart,
    effect_curves,
    matched_pair,
    unit_ranking,
)
from pdtui.pictures.matplotlib_page import figure_page, policy_title
from pdtui.pictures.plot_colors import BLUE, GREEN, GREY, VERMILLION, to_hex

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_A_PAGE = 8
"""Attributes on one page."""
_MATCHED, _PROBED, _OTHER, _FAINT = (to_hex(color) for color in (VERMILLION, GREEN, BLUE, GREY))
NAMES = ("spectrograms", "discrepancies", "effects", "side-effects", "hit-rates")
"""Stems of the files; those with a panel for each attribute are numbered where one page is not enough."""


def draw_dissection_figures(folder: Path, dissection: Dissection) -> list[Path]:
    """Draw everything into a folder; files of the same names are replaced.

    Returns:
        the files.

    Raises:
        PictureError: matplotlib is not installed, or a file cannot be written.
    """
    columns = range(len(dissection.attributes))
    written = _draw_pages(folder, dissection, "spectrograms", columns, _spectrograms)
    written += _draw_pages(folder, dissection, "discrepancies", columns, _discrepancies)
    written += _draw_pages(folder, dissection, "effects", columns, _effects)
    return [*written, draw_side_effects(folder, dissection), draw_matching_hits(folder, dissection)]


def existing_figures(folder: Path) -> list[Path]:
    """Files in a folder that `draw_dissection_figures` may replace."""
    return sorted(
        path for name in NAMES for path in (*folder.glob(f"{name}.png"), *folder.glob(f"{name}-[0-9]*.png"))
    )


@dataclass(frozen=True)
class _Sheet:
    """Where one page of panels goes."""

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
    """Panels row by row; those that are left over stay empty."""
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
            left, right = panels[2 * number : 2 * number + 2]
            pair = matched_pair(dissection, column)
            if pair is None:
                _leave_out(left, dissection, column)
                right.set_axis_off()
            else:
                _spectrogram_pair(figure, left, right, pair)
        for rest in panels[2 * count :]:
            rest.set_axis_off()


def _spectrogram_pair(figure: Figure, left: Axes, right: Axes, pair: MatchedPair) -> None:
    attribute = pair.attribute
    names = (f"{attribute.name} ({attribute.unit})", f"unit {pair.label}")
    shown: tuple[SpectrogramChart, ...] = (pair.of_attribute, pair.of_unit)
    mesh: Any = None
    for panel, name, one in zip((left, right), names, shown, strict=True):
        values = np.maximum(one.decibels.T, pair.low)
        mesh = panel.pcolormesh(
            one.times, one.frequencies, values, cmap="viridis", vmin=pair.low, vmax=pair.high, rasterized=True
        )
        panel.set_title(name)
        panel.set_xlabel("time (s)")
    left.set_ylabel("frequency (Hz)")
    right.tick_params(labelleft=False)
    figure.colorbar(mesh, ax=right, pad=0.03, aspect=14).set_label("dB", labelpad=1)


def _discrepancies(sheet: _Sheet, dissection: Dissection) -> None:
    count, title = len(sheet.columns), f"{policy_title(dissection)}: discrepancy of the nearest units"
    with figure_page(sheet.path, _height(count, 4, 1.9), title) as figure:
        panels = _grid(figure, count, 4)
        for panel, column in zip(panels, sheet.columns, strict=False):
            ranking = unit_ranking(dissection, column)
            if not ranking.labels:
                _leave_out(panel, dissection, column)
                continue
            places = np.arange(len(ranking.labels))
            colors = [_MATCHED, *[_OTHER] * (len(places) - 1)]
            panel.barh(places, ranking.discrepancies, color=colors, height=0.75)
            panel.set_yticks(places, ranking.labels)
            panel.invert_yaxis()
            panel.ticklabel_format(axis="x", scilimits=(-2, 3), useMathText=True)
            panel.set_title(dissection.attributes[column].name)
            panel.set_xlabel(f"discrepancy\n(first: {ranking.level_shares[0]:.0%} mean level)")
        panels[0].set_ylabel("unit")
        for rest in panels[count:]:
            rest.set_axis_off()


def _effects(sheet: _Sheet, dissection: Dissection) -> None:
    count = len(sheet.columns)
    title = f"{policy_title(dissection)}: effect of single units, mean and 95 % interval"
    with figure_page(sheet.path, _height(count, 4, 1.8) + 0.25, title) as figure:
        panels = _grid(figure, count, 4)
        for panel, column in zip(panels, sheet.columns, strict=False):
            attribute = dissection.attributes[column]
            panel.axhline(0, color=_FAINT, linewidth=0.6)
            for curve in effect_curves(dissection, column):
                _effect_curve(panel, curve)
            panel.set_title(attribute.name)
            panel.set_ylabel(f"change ({attribute.unit})" if attribute.unit else "change")
            panel.set_xlabel("output v")
            panel.legend(loc="best", handlelength=1.2, borderpad=0.1)
        for rest in panels[count:]:
            rest.set_axis_off()
        _key(figure, {"best probed": _PROBED, "first match": _MATCHED})


def _effect_curve(panel: Axes, curve: EffectCurve) -> None:
    color = _MATCHED if curve.matched else _PROBED
    spread = np.vstack([curve.means - curve.lows, curve.highs - curve.means])
    panel.errorbar(
        curve.values, curve.means, yerr=np.nan_to_num(np.maximum(spread, 0.0)), color=color, marker="o",
        markersize=2.5, capsize=2, elinewidth=0.8, label=curve.label,
    )  # fmt: skip
    fell = curve.falls > 0
    if fell.any():
        panel.plot(curve.values[fell], curve.means[fell], "x", color="black", markersize=4)


def _key(figure: Figure, colors: dict[str, str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=color, marker="o", markersize=3, label=name) for name, color in colors.items()
    ]
    handles.append(
        Line2D([], [], color="black", marker="x", linestyle="", markersize=4, label="fell from some starts")
    )
    figure.legend(handles=handles, loc="outside lower left", ncols=len(handles))


def _leave_out(panel: Axes, dissection: Dissection, column: int) -> None:
    name = dissection.attributes[column].name
    panel.set_axis_off()
    panel.set_title(name)
    panel.text(0, 0.8, dissection.matching.flaws.get(name, "nothing matches"), wrap=True, va="top")
