"""`pdtui evaluate --strip`: frames of the best, the median and the worst seed of each behavior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import PictureError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.robot_links_and_state import Link
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.held_run import HeldRunFilm, film_held_run
from pdtui.evaluation.protocol_settings import RunTimes
from pdtui.evaluation.ranked_runs import RankedRun
from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.perspective_camera import PerspectiveCamera
from pdtui.pictures.plot_colors import BLUE, GRAY, GREEN, VERMILLION, color_to_hex
from pdtui.robots.geometry import capsule_ends, compute_link_poses

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW_HEIGHT, _HEAD = 0.82, 0.55  # inches
_ELEVATION = 20.0  # of the camera, degrees
_POINTS_PER_INCH = 72.0


@dataclass(frozen=True)
class BehaviorStrip:
    """The frames of one run."""

    run: RankedRun
    film: HeldRunFilm


def frame_seconds(times: RunTimes) -> list[float]:
    """Return when frames are taken.

    Of a long hold: at the press, in the first and the last 5 s, and after the release. Of a short one: at
    equal distances from the press to the end.
    """
    held, end = times.held * times.dt, (times.held + min(times.after, times.window) - 1) * times.dt
    if held < 10.0:
        return [round(one, 3) for one in np.linspace(0.0, end, 8).tolist()]
    wanted = [0.0, 1.0, 2.5, 5.0, held / 2.0, held - 2.5, held, end]
    return sorted({round(one, 3) for one in wanted if 0.0 <= one <= end})


def film_strips(
    plan: EvaluationPlan, runs: Sequence[RankedRun], progress: StepProgress | None = None
) -> list[BehaviorStrip]:
    """Run every run once more and keep its frames.

    Raises:
        PictureError: The robot has no shapes to draw, or there is no run.
    """
    robot, strips = plan.loop.robot, []
    if not robot.links or not runs:
        missing = "no behavior with an aim or a task" if robot.links else "no shapes to draw"
        raise PictureError(f"{robot.name}: {missing}, so there is nothing to show in a strip")
    for run in runs:
        strips.append(BehaviorStrip(run, film_held_run(plan.loop, run.plan, frame_seconds(run.plan.times))))
        if progress is not None:
            progress(len(strips), len(runs))
    return strips


def draw_strips(path: Path, plan: EvaluationPlan, strips: Sequence[BehaviorStrip]) -> None:
    """Draw one row of frames for each strip, and the way from above.

    Raises:
        PictureError: The file cannot be written.
    """
    links = plan.loop.robot.links
    columns = max(len(strip.film.seconds) for strip in strips) + 1
    name = plan.loop.robot.name
    title = f"{name}, {plan.loop.policy.name}: best, median and worst of {len(plan.seeds)} seeds"
    with open_figure_page(path, _HEAD + _ROW_HEIGHT * len(strips), title) as figure:
        axes = figure.subplots(len(strips), columns, squeeze=False)
        extent = _find_extent(links, strips)
        for strip, row in zip(strips, axes, strict=True):
            for axis in row:
                axis.set_axis_off()
            for axis, seconds, poses in zip(row[1:], strip.film.seconds, strip.film.poses, strict=False):
                _draw_robot(axis, links, poses, extent)
                axis.set_title(f"{seconds:.1f} s", fontsize=5.5, pad=1, loc="center")
            _draw_way(row[0], strip)
            run, word = strip.run, "met" if strip.run.met else "not met"
            ended = f", {strip.film.outcome}" if strip.film.outcome else ""
            head = f"{run.behavior} ({run.criterion})\n" if run.rank == "best" else ""
            row[0].set_title(
                f"{head}{run.rank}, seed {run.plan.seed}: {word}{ended}", fontsize=5.5, pad=1, loc="left"
            )


def _find_extent(links: Sequence[Link], strips: Sequence[BehaviorStrip]) -> float:
    """Return the widest stretch of the robot from its first body in any frame, m."""
    widest = 0.0
    for strip in strips:
        if len(strip.film.poses):
            ends = capsule_ends(links, compute_link_poses(links, strip.film.poses))
            roots = strip.film.poses[:, links[0].body, None, None, :3]
            widest = max(widest, float(np.linalg.norm(ends - roots, axis=-1).max()))
    return widest or 1.0


def _draw_robot(axis: Axes, links: Sequence[Link], poses: Floats, extent: float) -> None:
    from matplotlib.collections import LineCollection

    ends = capsule_ends(links, compute_link_poses(links, poses))
    root = poses[links[0].body]
    camera = PerspectiveCamera(
        (float(root[0]), float(root[1]), 0.45 * extent), _ELEVATION, extent, 1.0, (0.0, 0.0)
    )
    inches = _ROW_HEIGHT * 0.8 / (2.6 * extent)  # of paper per m
    for segments, color in ((ends * (1.0, 1.0, 0.0), GRAY), (ends, BLUE)):
        dots, _, _ = camera.project(segments)
        radii = [2.0 * min(link.size) * inches * _POINTS_PER_INCH for link in links]
        widths = [max(0.6, radius) for radius in radii] if color is BLUE else [0.4] * len(links)
        # The ends of a sphere coincide, and a line without length is not drawn.
        dots[:, 1] += 1e-3 * extent * np.all(dots[:, 0] == dots[:, 1], axis=-1)[:, None]
        axis.add_collection(
            LineCollection(
                list(dots), linewidths=widths, colors=color_to_hex(color), capstyle="round", alpha=0.8
            )
        )
    axis.set_xlim(-1.3 * extent, 1.3 * extent)
    axis.set_ylim(1.3 * extent, -1.3 * extent)
    axis.set_aspect("equal")


def _draw_way(axis: Axes, strip: BehaviorStrip) -> None:
    """Draw the way from above: held, then released; a dot marks the press."""
    way, held = strip.film.way, strip.film.held
    if not len(way):
        return
    axis.plot(*way[: held + 1].T, color=color_to_hex(VERMILLION), linewidth=0.8)
    axis.plot(*way[held:].T, color=color_to_hex(GREEN), linewidth=0.8)
    axis.plot(*way[0], "o", markersize=2, color="black")
    axis.set_aspect("equal", adjustable="datalim")
