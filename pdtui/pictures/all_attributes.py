"""Figures of all attributes at once: side effects, and how well matching finds what steers."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarise_dissection
from pdtui.pictures.chart_data import side_effect_matrix
from pdtui.pictures.matplotlib_page import figure_page, policy_title
from pdtui.pictures.plot_colors import GREEN, GREY, VERMILLION, diverging, to_hex
from pdtui.probing.confirmation import TOP_MATCHES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MATCHED, _PROBED, _FAINT = to_hex(VERMILLION), to_hex(GREEN), to_hex(GREY)


def draw_side_effects(target: Path | BytesIO, dissection: Dissection) -> None:
    """Draw units × attributes as a heat map for each sign of the output."""
    effects = side_effect_matrix(dissection)
    title = f"{policy_title(dissection)}: side effects of single units"
    rows = max(1, len(effects.by_value))
    with figure_page(target, 0.6 + rows * (0.6 + 0.155 * len(effects.attributes)), title) as figure:
        panels = list(figure.subplots(rows, 1, squeeze=False).flat)
        for panel, (value, matrix) in zip(panels, effects.by_value.items(), strict=False):
            panel.imshow(diverging(matrix.T, effects.limit), aspect="auto", interpolation="nearest")
            panel.set_title(f"output held at v = {value:g}")
            panel.set_yticks(range(len(effects.attributes)), effects.attributes)
            panel.set_xticks(range(len(effects.units)), effects.units, rotation=90)
            panel.tick_params(axis="x", labelsize=min(7.0, 420.0 / max(1, len(effects.units))))
            panel.set_xlabel("unit")
        _colorbar(figure, panels, effects.limit)


def _colorbar(figure: Figure, panels: Sequence[Axes], limit: float) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    shades = diverging(np.linspace(-limit, limit, 201), limit) / 255
    bar = figure.colorbar(
        ScalarMappable(Normalize(-limit, limit), ListedColormap(shades)),
        ax=list(panels),
        aspect=40,
        pad=0.015,
        extend="both",
    )
    bar.set_label("change, in standard deviations of the attribute")


def draw_matching_hits(target: Path | BytesIO, dissection: Dissection) -> None:
    """Draw how well matching finds the units that probing finds, one row per attribute."""
    attributes = summarise_dissection(dissection)["attributes"]
    names = [attribute["name"] for attribute in attributes]
    hits = [attribute["hits"] for attribute in attributes]
    places = np.arange(len(names))
    with figure_page(
        target, 1.1 + 0.19 * len(names), f"{policy_title(dissection)}: how well matching finds units that act"
    ) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        width = 0.8 / (1 + len(TOP_MATCHES))
        shades = ("#c85200", "#ff9a4d", "#ffc79b")
        keys = ("first", *(f"best_{count}" for count in TOP_MATCHES))
        labels = ("first match", *(f"first {count} matches" for count in TOP_MATCHES))
        for number, (key, label) in enumerate(zip(keys, labels, strict=True)):
            shares = 100 * np.array([float(_or_nan(hit[key])) for hit in hits])
            left.barh(
                places + (number - len(TOP_MATCHES) / 2) * width,
                shares,
                width,
                color=shades[number],
                label=label,
            )
        random = 100 * np.array([_or_nan(hit["random"]) for hit in hits])
        left.plot(random, places, "|", color="black", markersize=9, label="a unit drawn at random")
        left.set(xlabel="hits (%)", xlim=(0, 102), title="Share among the strongest tenth")
        left.set_yticks(places, names)
        left.invert_yaxis()
        for key, label, color, marker in (
            ("held_out_matching", "ranked by matching", _MATCHED, "o"),
            ("held_out_probing", "ranked by probing", _PROBED, "s"),
        ):
            right.plot(
                [_or_nan(hit[key]) for hit in hits], places, marker, color=color, markersize=4, label=label
            )
        right.axvline(0, color=_FAINT, linewidth=0.6)
        right.set(xlabel="rank correlation with the effect on other starts", xlim=(-1.05, 1.05))
        right.set_title(f"Held out: {len(dissection.controls)} units drawn at random")
        for panel in (left, right):
            panel.grid(axis="y", linewidth=0.3, alpha=0.5)
            panel.set_axisbelow(True)
            panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else float(value)
