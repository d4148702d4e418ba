"""`pdtui evaluate --strip`: frames of the best, the median and the worst seed of each behavior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import PictureError
from pdtui.core.robot_links_and_state import Link
from pdtui.core.worker_pool import StepProgress
from pdtui.evaluation.behavior_evaluation import MapEvaluation
from pdtui.evaluation.behavior_summary import BehaviorEvaluation
from pdtui.evaluation.evaluation_plan import EvaluationPlan
from pdtui.evaluation.held_run import HeldRunFilm, HeldRunPlan, film_held_run
from pdtui.evaluation.protocol_settings import RunTimes
from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.perspective_camera import PerspectiveCamera
from pdtui.pictures.plot_colors import BLUE, GREEN, GREY, VERMILLION, color_to_hex
from pdtui.robots.geometry import capsule_ends, compute_link_poses

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW_HEIGHT, _HEAD = 0.82, 0.55  # inches
_ELEVATION = 20.0  # of the camera, degrees
_POINTS_PER_INCH = 72.0


@dataclass(frozen=True)
class BehaviorStrip:
    """The frames of one seed of a behavior.

    Attributes:
        behavior: Name of the behavior.
        seed: The seed.
        rank: ``best``, ``median`` or ``worst``.
        met: Whether the run meets the behavior's criterion.
        film: The frames.
    """

    behavior: str
    seed: int
    rank: str
    met: bool
    film: HeldRunFilm


def rank_seeds(row: BehaviorEvaluation) -> list[int]:
    """Return the positions of a behavior's seeds, the best first: whether they meet it, then by effect."""
    return sorted(
        range(row.runs), key=lambda one: (row.seed_met[one], row.wanted * row.seed_effects[one]), reverse=True
    )


def pick_seeds(row: BehaviorEvaluation) -> dict[str, int]:
    """Return the positions of the ``best``, the ``median`` and the ``worst`` seed of a behavior."""
    order = rank_seeds(row)
    return {"best": order[0], "median": order[len(order) // 2], "worst": order[-1]}


def frame_seconds(times: RunTimes) -> list[float]:
    """Return when frames are taken: at the press, in the first and the last 5 s, and after the release."""
    held, end = times.held * times.dt, (times.held + min(times.after, times.window) - 1) * times.dt
    wanted = [0.0, 1.0, 2.5, 5.0, held / 2.0, held - 2.5, held, end]
    return sorted({round(one, 3) for one in wanted if 0.0 <= one <= end})


def film_strips(
    plan: EvaluationPlan, result: MapEvaluation, progress: StepProgress | None = None
) -> list[BehaviorStrip]:
    """Run the best, the median and the worst seed of each behavior with an aim once more.

    Raises:
        PictureError: The robot has no shapes to draw, or no behavior has an aim.
    """
    robot = plan.loop.robot
    if not robot.links or not result.behaviors:
        missing = "no behavior with an aim" if robot.links else "no shapes to draw"
        raise PictureError(f"{robot.name}: {missing}, so there is nothing to show in a strip")
    strips, rows = [], result.undisturbed()
    for row in rows:
        for rank, place in pick_seeds(row).items():
            seed = result.seeds[place]
            times = plan.times(row.behavior, seed)
            run = HeldRunPlan(row.behavior, seed, times)
            film = film_held_run(plan.loop, run, frame_seconds(times))
            strips.append(BehaviorStrip(row.behavior, seed, rank, row.seed_met[place], film))
            if progress is not None:
                progress(len(strips), 3 * len(rows))
    return strips


def draw_strips(
    path: Path, plan: EvaluationPlan, result: MapEvaluation, strips: Sequence[BehaviorStrip]
) -> None:
    """Draw one row of frames for each strip, and the way from above.

    Raises:
        PictureError: The file cannot be written.
    """
    links = plan.loop.robot.links
    criteria = {row.behavior: row.criterion for row in result.undisturbed()}
    columns = max(len(strip.film.seconds) for strip in strips) + 1
    title = f"{result.robot}, {Path(result.policy).stem}: best, median and worst of {len(result.seeds)} seeds"
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
            word = "met" if strip.met else "not met"
            head = f"{strip.behavior} ({criteria[strip.behavior]})\n" if strip.rank == "best" else ""
            row[0].set_title(
                f"{head}{strip.rank}, seed {strip.seed}: {word}{', fell' if strip.film.fell else ''}",
                fontsize=5.5,
                pad=1,
                loc="left",
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
    for segments, color in ((ends * (1.0, 1.0, 0.0), GREY), (ends, BLUE)):
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
