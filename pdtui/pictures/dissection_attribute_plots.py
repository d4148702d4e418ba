"""Plots of one attribute: spectrograms, nearest units and effects; and a page with all of them.

Other pages show one kind of plot for several attributes.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from pdtui.dissection.dissection_result import Dissection
from pdtui.pictures.dissection_chart_data import (
    compute_effect_curves,
    matched_spectrograms,
    rank_nearest_units,
)
from pdtui.pictures.matplotlib_page import format_policy_title, open_figure_page
from pdtui.pictures.plot_colors import BLUE, GRAY, GREEN, VERMILLION, color_to_hex

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MATCHED, _PROBED, _OTHER, _FAINT = (color_to_hex(color) for color in (VERMILLION, GREEN, BLUE, GRAY))


def draw_attribute_page(dissection: Dissection, column: int) -> bytes:
    """Draw everything about one attribute on a page, and return the PNG file."""
    attribute, target = dissection.attributes[column], io.BytesIO()
    label = f"{attribute.name} ({attribute.unit})" if attribute.unit else attribute.name
    with open_figure_page(target, 4.4, f"{format_policy_title(dissection)}: {label}") as figure:
        (upper_left, upper_right), (lower_left, lower_right) = figure.subplots(2, 2)
        draw_spectrograms(figure, upper_left, upper_right, dissection, column)
        draw_ranking(lower_left, dissection, column)
        lower_left.set_ylabel("unit")
        draw_effects(lower_right, dissection, column)
        lower_right.set_title(f"effect of single units on {attribute.name}, 95 % intervals")
        draw_effect_key(figure)
    return target.getvalue()


def draw_spectrograms(figure: Figure, left: Axes, right: Axes, dissection: Dissection, column: int) -> None:
    """Draw the spectrograms of an attribute and of its best match, in the same colors."""
    pair = matched_spectrograms(dissection, column)
    if pair is None:
        _leave_out(left, dissection, column)
        right.set_axis_off()
        return
    mesh, attribute = None, pair.attribute
    style: dict[str, Any] = {"cmap": "viridis", "vmin": pair.low, "vmax": pair.high, "rasterized": True}
    for panel, name, chart in (
        (left, f"{attribute.name} ({attribute.unit})", pair.of_attribute),
        (right, f"unit {pair.label}", pair.of_unit),
    ):
        mesh = panel.pcolormesh(
            chart.times, chart.frequencies, np.maximum(chart.decibels.T, pair.low), **style
        )
        panel.set_title(name)
        panel.set_xlabel("time (s)")
    left.set_ylabel("frequency (Hz)")
    right.tick_params(labelleft=False)
    assert mesh is not None
    figure.colorbar(mesh, ax=right, pad=0.03, aspect=14).set_label("dB", labelpad=1)


def draw_ranking(panel: Axes, dissection: Dissection, column: int) -> None:
    """Draw the discrepancies of the nearest units as bars, the nearest on top."""
    labels, discrepancies, level_shares = rank_nearest_units(dissection, column)
    if not labels:
        _leave_out(panel, dissection, column)
        return
    places = np.arange(len(labels))
    panel.barh(places, discrepancies, color=[_MATCHED, *[_OTHER] * (len(places) - 1)], height=0.75)
    panel.set_yticks(places, labels)
    panel.invert_yaxis()
    panel.ticklabel_format(axis="x", scilimits=(-2, 3), useMathText=True)
    panel.set_title(dissection.attributes[column].name)
    panel.set_xlabel(f"discrepancy\n(first: {level_shares[0]:.0%} mean level)")


def draw_effects(panel: Axes, dissection: Dissection, column: int) -> None:
    """Draw how the attribute changes with the output of the best probed unit and of the first match."""
    attribute = dissection.attributes[column]
    panel.axhline(0, color=_FAINT, linewidth=0.6)
    for curve in compute_effect_curves(dissection, column):
        color = _MATCHED if curve.matched else _PROBED
        spread = np.vstack([curve.means - curve.lows, curve.highs - curve.means])
        panel.errorbar(
            curve.values, curve.means, yerr=np.nan_to_num(np.maximum(spread, 0.0)), color=color, marker="o",
            markersize=2.5, capsize=2, elinewidth=0.8, label=curve.label,
        )  # fmt: skip
        fell = curve.falls > 0
        panel.plot(curve.values[fell], curve.means[fell], "x", color="black", markersize=4)
    panel.set_title(attribute.name)
    panel.set_ylabel(f"change ({attribute.unit})" if attribute.unit else "change")
    panel.set_xlabel(f"output v ({dissection.refined.effects.shape[2]} starts)")
    if panel.has_data() and panel.get_legend_handles_labels()[1]:
        # Beside the data: there is no corner in which no curve may end.
        panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.0, borderpad=0.0)


def draw_effect_key(figure: Figure) -> None:
    """Say below a page what the colors of effect curves mean."""
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=color, marker="o", markersize=3, label=name)
        for name, color in (("best probed", _PROBED), ("first match", _MATCHED))
    ]
    cross = Line2D(
        [], [], color="black", marker="x", linestyle="", markersize=4, label="fell from some starts"
    )
    figure.legend(handles=[*handles, cross], loc="outside lower left", ncols=3)


def _leave_out(panel: Axes, dissection: Dissection, column: int) -> None:
    name = dissection.attributes[column].name
    panel.set_axis_off()
    panel.set_title(name)
    panel.text(0, 0.8, dissection.matching.flaws.get(name, "nothing matches"), wrap=True, va="top")
