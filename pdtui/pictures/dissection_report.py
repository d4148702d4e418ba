"""The report of a dissection, a recording that opens laid out in the Rerun viewer, and where pictures go."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from pdtui.core.atomic_file import check_writable
from pdtui.core.errors import PictureError
from pdtui.dissection.dissection_findings import describe_findings
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarize_dissection
from pdtui.dissection.dissection_tables import dissection_tables
from pdtui.dissection.dissection_text import dissection_remarks
from pdtui.pictures.dissection_attribute_plots import draw_attribute_page
from pdtui.pictures.dissection_chart_data import (
    compute_effect_curves,
    matched_spectrograms,
    rank_nearest_units,
    side_effect_matrix,
)
from pdtui.pictures.dissection_figures import (
    draw_dissection_figures,
    draw_matching_hits,
    draw_side_effects,
    existing_figures,
)
from pdtui.pictures.plot_colors import ORANGE, SKY, RgbColor
from pdtui.pictures.rerun_report_file import TIME, open_report_file, rows_to_markdown, table_to_markdown
from pdtui.sessions.environment_versions import collect_versions

APP = "pdtui-dissection"
PROPERTY, VERSIONS = "dissection", "versions"
SUMMARY, SIDE_EFFECTS, HIT_RATES, ATTRIBUTES = "/summary", "/side_effects", "/hit_rates", "/attributes"
Log = Callable[[str, Any], None]


def write_dissection_report(path: Path, dissection: Dissection) -> None:
    """Write a dissection as a recording with its layout; an existing file is replaced once it is whole.

    Figures are the pages that matplotlib draws; the episode is live, with a cursor in time. The numbers that
    were drawn are there, too, and what ``--json`` prints is the property ``dissection``.

    Raises:
        PictureError: The file cannot be written.
    """
    with open_report_file(path, APP, _layout(dissection)) as recording:

        def log(entity: str, part: Any) -> None:
            rr.log(entity, part, static=True, recording=recording, strict=True)

        recording.send_recording_name(f"Dissection of {dissection.policy} on {dissection.robot}")
        recording.send_property(PROPERTY, rr.AnyValues(summary=json.dumps(summarize_dissection(dissection))))
        versions: dict[str, Any] = dict(collect_versions())
        recording.send_property(VERSIONS, rr.AnyValues(**versions))
        log(SUMMARY, rr.TextDocument(dissection_markdown(dissection), media_type=rr.MediaType.MARKDOWN))
        for column in range(len(dissection.attributes)):
            picture = draw_attribute_page(dissection, column)
            log(_attribute_entity(dissection, column, "figure"), _image(picture))
            _log_ranking(log, dissection, column)
            _log_effects(log, dissection, column)
            _log_episode(recording, log, dissection, column)
        _log_overviews(log, dissection)


def _layout(dissection: Dissection) -> rrb.Tabs:
    """Tabs: the figures of all attributes, which are shown first, each attribute, and the tables."""
    return rrb.Tabs(
        rrb.Horizontal(
            rrb.Spatial2DView(origin=SIDE_EFFECTS, name="Side effects"),
            rrb.Spatial2DView(origin=HIT_RATES, name="Matching against probing"),
            name="Overview",
        ),
        *(_attribute_tab(dissection, column) for column in range(len(dissection.attributes))),
        rrb.TextDocumentView(origin=SUMMARY, name="Summary and tables"),
        active_tab=0,
    )


def _attribute_tab(dissection: Dissection, column: int) -> rrb.Vertical:
    attribute = dissection.attributes[column]
    return rrb.Vertical(
        rrb.Spatial2DView(
            origin=_attribute_entity(dissection, column, "figure"),
            name=f"What matches and moves {attribute.name}",
        ),
        rrb.TimeSeriesView(
            origin=_attribute_entity(dissection, column, "episode"),
            name=f"Episode of seed {dissection.sample_episode.seed}: {attribute.name} and its best match",
        ),
        name=attribute.name,
        row_shares=[3, 1],
    )


def _attribute_entity(dissection: Dissection, column: int, part: str) -> str:
    return f"{ATTRIBUTES}/{rr.escape_entity_path_part(dissection.attributes[column].name)}/{part}"


def _image(content: bytes) -> rr.EncodedImage:
    return rr.EncodedImage(contents=content, media_type="image/png")


def _log_ranking(log: Log, dissection: Dissection, column: int) -> None:
    labels, discrepancies, level_shares = rank_nearest_units(dissection, column)
    if labels:
        columns = {"unit": labels, "discrepancy": discrepancies, "mean_level": level_shares}
        numbers = rr.AnyValues(**{name: pa.array(values) for name, values in columns.items()})
        log(_attribute_entity(dissection, column, "discrepancies"), numbers)


def _log_effects(log: Log, dissection: Dissection, column: int) -> None:
    for curve in compute_effect_curves(dissection, column):
        name = rr.escape_entity_path_part(f"unit {curve.label}, {curve.role}")
        numbers = {
            "output": curve.values,
            "effect": curve.means,
            "low": curve.lows,
            "high": curve.highs,
            "falls": curve.falls,
        }
        values = rr.AnyValues(**{key: pa.array(value) for key, value in numbers.items()})
        log(_attribute_entity(dissection, column, f"effects/{name}"), values)


def _log_episode(recording: rr.RecordingStream, log: Log, dissection: Dissection, column: int) -> None:
    episode, attribute = dissection.sample_episode, dissection.attributes[column]
    series: dict[str, tuple[NDArray[np.floating], str, RgbColor]] = {}
    series["attribute"] = (episode.attributes[:, column], f"{attribute.name} ({attribute.unit})", SKY)
    pair = matched_spectrograms(dissection, column)
    if pair is not None:
        series["unit"] = (episode.activations[:, episode.column(pair.unit)], f"unit {pair.label}", ORANGE)
    # Row t is the state after control step t.
    seconds = (np.arange(len(episode.attributes), dtype=np.float64) + 1) * dissection.dt
    times = rr.TimeColumn(TIME, duration=seconds)
    for part, (values, name, color) in series.items():
        entity = _attribute_entity(dissection, column, f"episode/{part}")
        log(entity, rr.SeriesLines(names=[name], colors=[color], widths=[1.5]))
        rr.send_columns(entity, [times], rr.Scalars.columns(scalars=values), recording=recording, strict=True)


def _log_overviews(log: Log, dissection: Dissection) -> None:
    for entity, draw in ((SIDE_EFFECTS, draw_side_effects), (HIT_RATES, draw_matching_hits)):
        draw(target := BytesIO(), dissection)
        log(f"{entity}/figure", _image(target.getvalue()))
    effects = side_effect_matrix(dissection)
    for value, matrix in effects.by_value.items():
        entity = f"/side_effect_numbers/{rr.escape_entity_path_part(f'v = {value:g}')}"
        log(entity, rr.Tensor(matrix, dim_names=("unit", "attribute")))
        log(entity, rr.AnyValues(units=pa.array(effects.units), attributes=pa.array(effects.attributes)))


def dissection_markdown(dissection: Dissection) -> str:
    """Return what was found in plain words, and everything else that the terminal prints, as Markdown."""
    summary = summarize_dissection(dissection)
    parts = [f"# Dissection of {summary['policy']} on {summary['robot']}"]
    for heading, lines in describe_findings(summary).items():
        parts += [f"## {heading}", "\n".join(f"- {line}" for line in lines)]
    parts += ["## Where it comes from", _origin(dissection, summary)]
    parts += [table_to_markdown(table) for table in dissection_tables(summary)]
    parts += ["## Remarks", "\n".join(f"- {line}" for line in dissection_remarks(summary))]
    return "\n\n".join(parts) + "\n"


def _origin(dissection: Dissection, summary: dict[str, Any]) -> str:
    preset, dt, shown = dissection.preset, dissection.dt, dissection.sample_episode.seed
    versions = collect_versions()
    episodes = ", ".join(str(seed) for seed in summary["episodes"])
    rows = [
        ("policy", f"{summary['policy']}, SHA-256 `{summary['sha256']}`"),
        ("hidden layers", " · ".join(f"{width} units" for width in dissection.layers)),
        ("seed", f"{summary['seed']}; episodes of seeds {episodes}, pictured: {shown}"),
        (
            "spectrum",
            f"preset `{preset}`: {preset.window.title()} window of {preset.length} steps, hop "
            f"{preset.hop}; {dt:g} s per step",
        ),
        ("probed", f"{summary['rollouts']} roll-outs, {summary['control_steps']} control steps"),
        ("versions", ", ".join(f"{name} {versions[name]}" for name in ("pdtui", "mujoco", "torch", "numpy"))),
    ]
    return rows_to_markdown(["", ""], rows)


@dataclass(frozen=True)
class PictureOutputs:
    """Where the pictures of one dissection go: the report and, unless it is None, a folder of figures.

    `kind` is the format of the figures: ``png``, ``pdf`` or ``svg``.
    """

    report: Path
    figures: Path | None
    overwrite: bool
    kind: str = "png"

    def check(self) -> None:
        """Raise a `PictureError`, before minutes of work, if a file already exists or cannot be written."""
        if self.report.suffix != ".rrd":
            raise PictureError(f"{self.report}: expected a name that ends in .rrd; the viewer opens no other")
        found = [self.report] if self.report.exists() else []
        if self.figures is not None:
            found += existing_figures(self.figures, self.kind)
        if found and not self.overwrite:
            raise PictureError(f"{found[0]}: already exists; --overwrite replaces it")
        for path in (self.report, *([] if self.figures is None else [self.figures / f"figure.{self.kind}"])):
            check_writable(path, PictureError)

    def draw(self, dissection: Dissection) -> list[Path]:
        """Write the pictures, and return their files; a `PictureError` says which one cannot be written."""
        write_dissection_report(self.report, dissection)
        figures = [] if self.figures is None else draw_dissection_figures(self.figures, dissection, self.kind)
        return [self.report, *figures]
