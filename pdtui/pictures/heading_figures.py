"""How well headings are held over time, as a PNG and as a recording for the viewer."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rich.table import Table

from pdtui.core.attributes import Floats, wrap_angles
from pdtui.core.printable_text import to_json
from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.picture_paths import write_pictures
from pdtui.pictures.plot_colors import CYCLE, GRAY, RgbColor, color_to_hex
from pdtui.pictures.rerun_report_file import TIME, open_report_file, table_to_markdown

APP = "pdtui-tracking"
PROPERTY = "tracking"
_BAND = (5.0, 95.0)
"""Percentiles of the seeds between which the band is drawn."""
_HEADINGS, _ERRORS, _FIGURES = "/headings", "/errors", "/figures"


@dataclass(frozen=True)
class TrackedHeading:
    """The headings that one behavior reached.

    Attributes:
        name: Name of the behavior, with its policy where several policies are compared.
        note: Its figures, for the legend.
        values: Headings in rad, shape (seeds, T); NaN after a fall.
    """

    name: str
    note: str
    values: Floats

    def statistics(self, target: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return mean heading, both ends of its middle 90 %, and mean |error|, in rad, shape (T,) each.

        They are over the seeds that have not fallen, and NaN where all have.
        """
        errors = np.abs(wrap_angles(target - self.values))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # steps that no seed reached
            low, high = np.nanpercentile(self.values, _BAND, axis=0)
            return np.nanmean(self.values, axis=0), low, high, np.nanmean(errors, axis=0)


@dataclass(frozen=True)
class HeadingFigure:
    """Everything that the pictures show.

    Attributes:
        target: Target heading at each control step in rad, shape (T,).
        dt: Seconds per control step.
        figures: The table that the command prints.
        summary: What ``--json`` prints.
    """

    title: str
    target: Floats
    dt: float
    behaviors: tuple[TrackedHeading, ...]
    figures: Table
    summary: Mapping[str, Any]

    @property
    def seeds(self) -> int:
        """Number of drives of each behavior."""
        return len(self.behaviors[0].values)


def draw_heading_pictures(paths: Sequence[Path], shown: HeadingFigure) -> None:
    """Write every picture in the format that the ending of its name says.

    Raises:
        PictureError: A file cannot be written.
    """
    write_pictures(paths, shown, _draw_heading_figure, _write_heading_recording)


def _draw_heading_figure(path: Path, shown: HeadingFigure) -> None:
    """Draw headings over their target, with the middle 90 % of seeds, and below them the mean |error|."""
    times: Floats = np.arange(len(shown.target), dtype=np.float64) * shown.dt
    with open_figure_page(path, 4.2, shown.title) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        above.plot(times, shown.target, color="black", linewidth=0.9, linestyle="--", label="target")
        for behavior, color in zip(shown.behaviors, cycle(map(color_to_hex, CYCLE)), strict=False):
            mean, low, high, error = behavior.statistics(shown.target)
            above.fill_between(times, low, high, color=color, alpha=0.2, linewidth=0.0)
            above.plot(times, mean, color=color, label=f"{behavior.name}: {behavior.note}")
            below.plot(times, error, color=color)
        above.set_title(f"{shown.seeds} seeds: mean and middle 90 %")
        above.set_ylabel("heading (rad)")
        above.set_xlim(0.0, float(times[-1]))
        below.set_ylabel("mean |error| (rad)")
        below.set_xlabel("time (s)")
        below.set_ylim(bottom=0.0)
        legend = above.get_legend_handles_labels()
        figure.legend(*legend, loc="outside lower left", ncols=min(3, len(legend[0])))


def _write_heading_recording(path: Path, shown: HeadingFigure) -> None:
    """Write the same as a recording: headings, errors, the table, and ``--json`` as a property."""
    moments = rr.TimeColumn(TIME, duration=np.arange(len(shown.target)) * shown.dt)
    with open_report_file(path, APP, _layout(shown)) as recording:

        def curve(entity: str, values: Floats, name: str, color: RgbColor, width: float) -> None:
            style = rr.SeriesLines(names=[name], colors=[color], widths=[width])
            rr.log(entity, style, static=True, recording=recording, strict=True)
            columns = rr.Scalars.columns(scalars=values)
            rr.send_columns(entity, [moments], columns, recording=recording, strict=True)

        recording.send_recording_name(shown.title)
        recording.send_property(PROPERTY, rr.AnyValues(summary=to_json(shown.summary, indent=None)))
        table = rr.TextDocument(table_to_markdown(shown.figures), media_type=rr.MediaType.MARKDOWN)
        rr.log(_FIGURES, table, static=True, recording=recording, strict=True)
        curve(f"{_HEADINGS}/target", shown.target, "target", GRAY, 1.5)
        for behavior, color in zip(shown.behaviors, cycle(CYCLE), strict=False):
            mean, low, high, error = behavior.statistics(shown.target)
            part = rr.escape_entity_path_part(behavior.name)
            red, green, blue = color
            faint = (red // 2, green // 2, blue // 2)
            for end, values in (("low", low), ("high", high)):
                curve(f"{_HEADINGS}/{part}/{end}", values, f"{behavior.name}, {end} end of 90 %", faint, 0.7)
            curve(f"{_HEADINGS}/{part}/mean", mean, behavior.name, color, 2.0)
            curve(f"{_ERRORS}/{part}", error, behavior.name, color, 1.5)


def _layout(shown: HeadingFigure) -> rrb.Vertical:
    return rrb.Vertical(
        rrb.TimeSeriesView(
            origin=_HEADINGS, name=f"Heading (rad), mean and middle 90 % of {shown.seeds} seeds"
        ),
        rrb.Horizontal(
            rrb.TimeSeriesView(origin=_ERRORS, name=f"Mean |error| (rad) of {shown.seeds} seeds"),
            rrb.TextDocumentView(origin=_FIGURES, name="Figures"),
            column_shares=[3, 2],
        ),
        row_shares=[3, 2],
    )
