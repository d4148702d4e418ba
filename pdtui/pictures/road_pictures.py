"""Ways of cars on roads from above, colored by behavior, as a PNG and as a recording for the viewer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pdtui.core.attributes import Floats
from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.picture_paths import write_pictures
from pdtui.pictures.plot_colors import CYCLE, GRAY, RgbColor, color_to_hex
from pdtui.pictures.rerun_report_file import open_report_file

APP = "pdtui-driving"
_COLUMNS = 2
_LIGHT: RgbColor = (205, 205, 205)
_DARK: RgbColor = (60, 60, 60)
_ALONE: RgbColor = (0, 0, 0)


@dataclass(frozen=True, eq=False)
class RoadPicture:
    """What one scene's picture shows.

    Attributes:
        title: The scene and how its drives ended.
        lines: Lines of the road, x and y in m, shape (N, 2) each.
        boxes: What stands on the road: x, y (m), yaw (rad), length and width (m), shape (K, 5).
        tracks: Ways of other cars, x and y in m, shape (N, 2) each.
        alone: Way of the policy alone, x and y in m, shape (S, 2).
        shared: Way with an operator, shape (T, 2).
        behaviors: Name of the behavior that acted in each of its steps; empty where none did.
    """

    title: str
    lines: tuple[Floats, ...]
    boxes: Floats
    tracks: tuple[Floats, ...]
    alone: Floats
    shared: Floats
    behaviors: tuple[str, ...]

    def pieces(self) -> Iterator[tuple[str, Floats]]:
        """Yield the shared way piece by piece, each with its behavior; neighboring pieces share a place."""
        for name, steps in groupby(range(len(self.shared)), key=lambda step: self.behaviors[step]):
            first, *rest = steps
            last = rest[-1] if rest else first
            yield name, self.shared[max(first - 1, 0) : last + 1]


def draw_road_pictures(paths: Sequence[Path], title: str, pictures: Sequence[RoadPicture]) -> None:
    """Write every picture in the format that the ending of its name says.

    Raises:
        PictureError: A file cannot be written.
    """
    write_pictures(
        paths,
        pictures,
        lambda path, shown: _draw_page(path, title, shown),
        lambda path, shown: _write_recording(path, title, shown),
    )


def behavior_colors(pictures: Sequence[RoadPicture]) -> dict[str, RgbColor]:
    """Return a color for each behavior that occurs; gray for none."""
    names = sorted({name for one in pictures for name in one.behaviors if name})
    return {"": GRAY} | {name: CYCLE[row % len(CYCLE)] for row, name in enumerate(names)}


def box_corners(boxes: Floats) -> Floats:
    """Return the corners of boxes (x, y, yaw, length, width), in order around each, shape (K, 4, 2)."""
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / 2
    forward = np.stack([np.cos(boxes[:, 2]), np.sin(boxes[:, 2])], axis=-1)[:, None]
    left = np.stack([-forward[..., 1], forward[..., 0]], axis=-1)
    return np.asarray(
        boxes[:, None, :2]
        + forward * (signs[:, 0] * boxes[:, 3:4])[..., None]
        + left * (signs[:, 1] * boxes[:, 4:5])[..., None]
    )


def _draw_page(path: Path, title: str, pictures: Sequence[RoadPicture]) -> None:
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.lines import Line2D

    colors = behavior_colors(pictures)
    rows = math.ceil(len(pictures) / _COLUMNS)
    with open_figure_page(path, 0.8 + 2.8 * rows, title) as figure:
        for axes, shown in zip(figure.subplots(rows, _COLUMNS, squeeze=False).flat, pictures, strict=False):
            axes.add_collection(
                LineCollection(list(shown.lines), colors=color_to_hex(_LIGHT), linewidths=0.5)
            )
            for track in shown.tracks:
                axes.plot(*track.T, color=color_to_hex(_LIGHT), linewidth=0.5, linestyle=":")
            corners = list(box_corners(shown.boxes))
            axes.add_collection(PolyCollection(corners, facecolors=color_to_hex(_DARK), linewidths=0.0))
            axes.plot(*shown.alone.T, color=color_to_hex(_ALONE), linewidth=0.7, linestyle="--")
            axes.plot(*shown.alone[-1:].T, color=color_to_hex(_ALONE), marker="x", markersize=4)
            for name, piece in shown.pieces():
                axes.plot(*piece.T, color=color_to_hex(colors[name]), linewidth=1.6 if name else 1.1)
            axes.set_title(shown.title)
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_axis_off()
        for axes in figure.axes[len(pictures) :]:
            axes.set_axis_off()
        handles = [Line2D([], [], color=color_to_hex(_ALONE), linestyle="--", label="alone")]
        handles += [
            Line2D([], [], color=color_to_hex(color), label=name or "shared, no key")
            for name, color in colors.items()
        ]
        figure.legend(handles=handles, loc="outside lower left", ncols=min(6, len(handles)))


def _write_recording(path: Path, title: str, pictures: Sequence[RoadPicture]) -> None:
    colors = behavior_colors(pictures)
    views = [
        rrb.Spatial2DView(origin=f"/scene-{number}", name=shown.title)
        for number, shown in enumerate(pictures)
    ]
    with open_report_file(path, APP, rrb.Tabs(*views)) as recording:

        def strips(entity: str, lines: Sequence[Floats], color: RgbColor, radius: float) -> None:
            # The viewer's y axis points down.
            turned = [line * (1.0, -1.0) for line in lines if len(line) > 1]
            drawn = rr.LineStrips2D(turned, colors=[color], radii=[radius])
            rr.log(entity, drawn, static=True, recording=recording, strict=True)

        recording.send_recording_name(title)
        for number, shown in enumerate(pictures):
            scene = f"/scene-{number}"
            strips(f"{scene}/road", shown.lines, _LIGHT, 0.1)
            strips(f"{scene}/others", shown.tracks, _LIGHT, 0.15)
            corners = box_corners(shown.boxes)
            closed = [np.concatenate([one, one[:1]]) for one in corners]
            strips(f"{scene}/obstacles", closed, _DARK, 0.2)
            strips(f"{scene}/alone", [shown.alone], _ALONE, 0.25)
            for name, color in colors.items():
                pieces = [piece for its, piece in shown.pieces() if its == name]
                part = rr.escape_entity_path_part(name or "no key")
                strips(f"{scene}/shared/{part}", pieces, color, 0.4)
