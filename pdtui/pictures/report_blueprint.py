"""How the viewer lays a report out: a page of text, a tab for each attribute, the side effects."""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

from pdtui.dissection.dissection_result import Dissection
from pdtui.pictures.chart_data import effect_curves, matched_pair, side_effect_matrix, unit_ranking
from pdtui.pictures.viewer_axes import axes_view

SUMMARY, SIDE_EFFECTS, ATTRIBUTES = "/summary", "/side_effects", "/attributes"
_ROW = 20.0


def attribute_entity(dissection: Dissection, column: int, part: str) -> str:
    """Entity of one part of an attribute's pictures."""
    name = rr.escape_entity_path_part(dissection.attributes[column].name)
    return f"{ATTRIBUTES}/{name}/{part}"


def output_entity(value: float) -> str:
    """Entity name of the matrix for one output v."""
    return rr.escape_entity_path_part(f"v = {value:g}")


def matrix_size(shape: tuple[int, ...]) -> tuple[float, float]:
    """Width and height of the picture of a matrix of (units, attributes): attributes are its rows."""
    return min(60.0 * shape[0], max(1200.0, 20.0 * shape[0])), _ROW * shape[1]


def report_blueprint(dissection: Dissection) -> rrb.Blueprint:
    """Tabs: the tables, the side effects, and each attribute."""
    text = rrb.TextDocumentView(origin=SUMMARY, name="Summary")
    attributes = [_attribute(dissection, column) for column in range(len(dissection.attributes))]
    tabs = rrb.Tabs(text, _side_effects(dissection), *attributes)
    return rrb.Blueprint(tabs, rrb.TimePanel(timeline="time", state="hidden"), collapse_panels=True)


def _attribute(dissection: Dissection, column: int) -> rrb.Vertical:
    attribute, pair = dissection.attributes[column], matched_pair(dissection, column)
    label = f"{attribute.name} ({attribute.unit})"
    rows: list[rrb.Container | rrb.View] = []
    if pair is not None:
        colors = f"{pair.low:.0f} (dark) to {pair.high:.0f} dB (bright)"
        views = [("attribute", f"Spectrogram of {label}"), ("unit", f"Spectrogram of unit {pair.label}")]
        rows.append(
            rrb.Horizontal(
                *(
                    axes_view(
                        attribute_entity(dissection, column, f"spectrogram/{part}"), f"{name}, {colors}"
                    )
                    for part, name in views
                )
            )
        )
    lower: list[rrb.Container | rrb.View] = []
    if unit_ranking(dissection, column).labels:
        lower.append(
            axes_view(
                attribute_entity(dissection, column, "discrepancies"), f"Units nearest to {attribute.name}"
            )
        )
    curves = effect_curves(dissection, column)
    if curves:
        names = "; ".join(f"{curve.label}: {curve.role}" for curve in curves)
        title = f"Effect on {attribute.name}, 95 % intervals ({names})"
        lower.append(axes_view(attribute_entity(dissection, column, "effects"), title))
    if lower:
        rows.append(rrb.Horizontal(*lower))
    name = f"Episode of seed {dissection.sample_episode.seed}: {label} and its best match"
    rows.append(rrb.TimeSeriesView(origin=attribute_entity(dissection, column, "episode"), name=name))
    return rrb.Vertical(*rows, name=attribute.name, row_shares=[3] * (len(rows) - 1) + [2])


def _side_effects(dissection: Dissection) -> rrb.Container:
    effects = side_effect_matrix(dissection)
    ends = f"{-effects.limit:.2g} (red) to {effects.limit:+.2g} (blue) deviations of the attribute"
    longest = max(map(len, effects.attributes))
    views = [
        axes_view(
            f"{SIDE_EFFECTS}/{output_entity(value)}",
            f"Side effects of single units held at {value:g}: {ends}",
            *matrix_size(matrix.shape),
            more=(5.0 * longest, 40.0),
        )
        for value, matrix in effects.by_value.items()
    ]
    return rrb.Vertical(*views, name="Side effects")
