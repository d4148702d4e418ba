"""The course of training: discrepancies, effects and scores over control steps, as figures and recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rich.table import Table

from pdtui.core.attributes import Floats
from pdtui.core.printable_text import to_json
from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.picture_paths import write_pictures
from pdtui.pictures.plot_colors import CYCLE, GRAY, RgbColor, color_to_hex
from pdtui.pictures.rerun_report_file import TIME, open_report_file, table_to_markdown

APP = "pdtui-dynamics"
_PANEL_HEIGHT = 1.5
_FIGURES = "/figures"


@dataclass(frozen=True)
class CourseCurve:
    """One curve of one run.

    Attributes:
        name: What it is.
        values: One number for each checkpoint, shape (C,); NaN for none.
        parts: The curves whose mean it is, by name; they are drawn thin.
        compared: Whether it is what another curve is compared with.
    """

    name: str
    values: Floats
    parts: Mapping[str, Floats] = field(default_factory=dict)
    compared: bool = False


@dataclass(frozen=True)
class CoursePanel:
    """Curves on one axis.

    Attributes:
        label: Label of the axis.
        curves: The curves of each run.
    """

    label: str
    curves: Sequence[Sequence[CourseCurve]]


@dataclass(frozen=True)
class LearningCourse:
    """Everything that the pictures show.

    Attributes:
        title: Title of the page.
        steps: Control steps at each checkpoint of each run.
        panels: From top to bottom.
        table, summary: What the command prints, and prints with ``--json``.
    """

    title: str
    steps: Sequence[Floats]
    panels: Sequence[CoursePanel]
    table: Table
    summary: Mapping[str, Any]


def draw_learning_course(paths: Sequence[Path], shown: LearningCourse) -> None:
    """Write every picture in the format that the ending of its name says.

    Raises:
        PictureError: A file cannot be written.
    """
    write_pictures(paths, shown, _draw_figure, _write_recording)


def _draw_figure(path: Path, shown: LearningCourse) -> None:
    with open_figure_page(path, 0.6 + _PANEL_HEIGHT * len(shown.panels), shown.title) as figure:
        plots = figure.subplots(len(shown.panels), 1, sharex=True, squeeze=False)[:, 0]
        for plot, panel in zip(plots, shown.panels, strict=True):
            for run, (curves, color) in enumerate(zip(panel.curves, cycle(CYCLE), strict=False)):
                for curve in curves:
                    _draw_curve(plot, curve, shown.steps[run] / 1e6, color, label=run == 0)
            plot.set_ylabel(panel.label)
            plot.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        plots[-1].set_xlabel("control steps of training (millions)")


def _draw_curve(plot: Any, curve: CourseCurve, steps: Floats, color: RgbColor, label: bool) -> None:
    shade = color_to_hex(GRAY if curve.compared else color)
    for part in curve.parts.values():
        plot.plot(steps, part, color=shade, linewidth=0.5, alpha=0.35)
    style = "--" if curve.compared else "-"
    name = curve.name if label else None
    plot.plot(steps, curve.values, style, color=shade, linewidth=1.6, label=name)


def _write_recording(path: Path, shown: LearningCourse) -> None:
    """Write curves over control steps, the table, and the summary as a property."""
    views = [
        rrb.TimeSeriesView(origin=f"/{number}", name=panel.label) for number, panel in enumerate(shown.panels)
    ]
    layout = rrb.Vertical(*views, rrb.TextDocumentView(origin=_FIGURES, name="Figures"))
    with open_report_file(path, APP, layout) as recording:
        recording.send_recording_name(shown.title)
        recording.send_property("dynamics", rr.AnyValues(summary=to_json(shown.summary, indent=None)))
        table = rr.TextDocument(table_to_markdown(shown.table), media_type=rr.MediaType.MARKDOWN)
        rr.log(_FIGURES, table, static=True, recording=recording, strict=True)
        for number, panel in enumerate(shown.panels):
            for run, (curves, color) in enumerate(zip(panel.curves, cycle(CYCLE), strict=False)):
                for curve in curves:
                    entity = f"/{number}/{run}/{rr.escape_entity_path_part(curve.name)}"
                    shade = GRAY if curve.compared else color
                    _log_curve(recording, entity, curve.name, shown.steps[run], curve.values, shade, 2.0)
                    for name, part in curve.parts.items():
                        own = f"{entity}/{rr.escape_entity_path_part(name)}"
                        _log_curve(recording, own, name, shown.steps[run], part, shade, 0.7)


def _log_curve(
    recording: rr.RecordingStream,
    entity: str,
    name: str,
    steps: Floats,
    values: Floats,
    color: RgbColor,
    width: float,
) -> None:
    known = np.isfinite(values)
    if not known.any():
        return
    style = rr.SeriesLines(names=[name], colors=[color], widths=[width])
    rr.log(entity, style, static=True, recording=recording, strict=True)
    moments = rr.TimeColumn(TIME, sequence=steps[known].astype(np.int64))
    columns = rr.Scalars.columns(scalars=values[known])
    rr.send_columns(entity, [moments], columns, recording=recording, strict=True)
