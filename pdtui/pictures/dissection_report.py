"""The report of a dissection: a recording that opens laid out in the Rerun viewer."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarise_dissection
from pdtui.pictures.chart_data import (
    EffectCurve,
    SpectrogramChart,
    effect_curves,
    matched_pair,
    sample_times,
    side_effect_matrix,
    unit_ranking,
)
from pdtui.pictures.markdown_report import dissection_markdown
from pdtui.pictures.plot_colors import GREEN, ORANGE, SKY, RgbColor, diverging
from pdtui.pictures.report_blueprint import (
    SIDE_EFFECTS,
    SUMMARY,
    attribute_entity,
    matrix_size,
    output_entity,
    report_blueprint,
)
from pdtui.pictures.report_file import open_report_file
from pdtui.pictures.viewer_axes import Log, ViewerAxes, ViewerAxis
from pdtui.sessions.environment_versions import collect_versions

APP, TIME = "pdtui-dissection", "time"
PROPERTY, VERSIONS = "dissection", "versions"


def write_dissection_report(path: Path, dissection: Dissection) -> None:
    """Write a dissection as a recording with its layout; an existing file is replaced once it is whole.

    Besides pictures it holds what they were drawn from: every effect curve and ranking as numbers at its
    entity, and what ``--json`` prints as the property ``dissection``.

    Raises:
        PictureError: the file cannot be written.
    """
    with open_report_file(path, APP, report_blueprint(dissection)) as recording:
        _write(recording, dissection)


def _write(recording: rr.RecordingStream, dissection: Dissection) -> None:
    def log(entity: str, part: Any) -> None:
        rr.log(entity, part, static=True, recording=recording, strict=True)

    recording.send_recording_name(f"Dissection of {dissection.policy} on {dissection.robot}")
    recording.send_property(PROPERTY, rr.AnyValues(summary=json.dumps(summarise_dissection(dissection))))
    versions: dict[str, Any] = dict(collect_versions())
    recording.send_property(VERSIONS, rr.AnyValues(**versions))
    log(SUMMARY, rr.TextDocument(dissection_markdown(dissection), media_type=rr.MediaType.MARKDOWN))
    for column in range(len(dissection.attributes)):
        _write_spectrograms(log, dissection, column)
        _write_ranking(log, dissection, column)
        _write_curves(log, dissection, column)
        _write_episode(recording, log, dissection, column)
    _write_matrices(log, dissection)


def _write_spectrograms(log: Log, dissection: Dissection, column: int) -> None:
    pair = matched_pair(dissection, column)
    if pair is None:
        return
    for part, shown in (("attribute", pair.of_attribute), ("unit", pair.of_unit)):
        axes = _spectrogram_axes(attribute_entity(dissection, column, f"spectrogram/{part}"), log, shown)
        axes.heat_map(np.maximum(shown.decibels.T[::-1], pair.low), pair.low, pair.high)
        axes.draw()


def _spectrogram_axes(entity: str, log: Log, shown: SpectrogramChart) -> ViewerAxes:
    # The first and last cell reach half a cell beyond their middle.
    times, frequencies = (_edges(values) for values in (shown.times, shown.frequencies))
    return ViewerAxes(
        entity, log, ViewerAxis.over("time (s)", times), ViewerAxis.over("frequency (Hz)", frequencies)
    )


def _edges(centers: Floats) -> Floats:
    half = (centers[1] - centers[0]) / 2 if len(centers) > 1 else 0.5
    return np.array([centers[0] - half, centers[-1] + half])


def _write_ranking(log: Log, dissection: Dissection, column: int) -> None:
    ranking = unit_ranking(dissection, column)
    count = len(ranking.labels)
    if not count:
        return
    names = ViewerAxis.named("unit", ranking.labels[::-1])
    x = ViewerAxis.over("discrepancy", np.array([0.0, *ranking.discrepancies]), margin=0.02)
    axes = ViewerAxes(attribute_entity(dissection, column, "discrepancies"), log, replace(x, low=0.0), names)
    axes.draw()
    colors = [ORANGE, *[SKY] * (count - 1)]
    axes.level_bars("bars", count - 0.5 - np.arange(count, dtype=np.float64), ranking.discrepancies, colors)
    numbers = rr.AnyValues(
        unit=pa.array(ranking.labels),
        discrepancy=pa.array(ranking.discrepancies),
        mean_level=pa.array(ranking.level_shares),
    )
    log(f"{axes.entity}/bars", numbers)


def _write_curves(log: Log, dissection: Dissection, column: int) -> None:
    curves = effect_curves(dissection, column)
    if not curves:
        return
    attribute = dissection.attributes[column]
    heights = np.concatenate(
        [[0.0], *([curve.means, curve.lows, curve.highs] for curve in curves)], axis=None
    )
    values = np.concatenate([curve.values for curve in curves])
    x = ViewerAxis.over("output v", values, margin=0.04)
    y = ViewerAxis.over(f"change of {attribute.name} ({attribute.unit})", heights, margin=0.08)
    axes = ViewerAxes(attribute_entity(dissection, column, "effects"), log, x, y)
    axes.draw()
    axes.level(0.0)
    for curve in curves:
        _write_curve(log, axes, curve, ORANGE if curve.matched else GREEN)


def _write_curve(log: Log, axes: ViewerAxes, curve: EffectCurve, color: RgbColor) -> None:
    name = rr.escape_entity_path_part(f"unit {curve.label}, {curve.role}")
    known = np.isfinite(curve.means)
    sure = np.isfinite(curve.lows)
    axes.line(name, axes.place(curve.values[known], curve.means[known]), color)
    axes.bars(name, curve.values[sure], curve.lows[sure], curve.highs[sure], color)
    numbers = {
        "output": curve.values,
        "effect": curve.means,
        "low": curve.lows,
        "high": curve.highs,
        "falls": curve.falls,
    }
    log(f"{axes.entity}/{name}", rr.AnyValues(**{key: pa.array(value) for key, value in numbers.items()}))


def _write_episode(recording: rr.RecordingStream, log: Log, dissection: Dissection, column: int) -> None:
    shown, attribute = dissection.sample_episode, dissection.attributes[column]
    series: dict[str, tuple[NDArray[np.floating], str, RgbColor]] = {}
    series["attribute"] = (shown.attributes[:, column], f"{attribute.name} ({attribute.unit})", SKY)
    pair = matched_pair(dissection, column)
    if pair is not None:
        series["unit"] = (shown.activations[:, shown.column(pair.unit)], f"unit {pair.label}", ORANGE)
    times = rr.TimeColumn(TIME, duration=sample_times(shown, dissection.dt))
    for part, (values, name, color) in series.items():
        entity = attribute_entity(dissection, column, f"episode/{part}")
        log(entity, rr.SeriesLines(names=[name], colors=[color], widths=[1.5]))
        rr.send_columns(entity, [times], rr.Scalars.columns(scalars=values), recording=recording, strict=True)


def _write_matrices(log: Log, dissection: Dissection) -> None:
    effects = side_effect_matrix(dissection)
    for value, matrix in effects.by_value.items():
        entity = f"{SIDE_EFFECTS}/{output_entity(value)}"
        columns, rows = (
            ViewerAxis.named("unit", effects.units),
            ViewerAxis.named("attribute", effects.attributes[::-1]),
        )
        axes = ViewerAxes(entity, log, columns, rows, *matrix_size(matrix.shape))
        axes.picture(diverging(matrix.T, effects.limit))
        axes.draw()
        log(f"{entity}/values", rr.Tensor(matrix, dim_names=("unit", "attribute")))
