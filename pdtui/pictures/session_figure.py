"""Two sessions side by side: their paths from above, and the attributes that differ most."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.plot_colors import BLUE, GRAY, VERMILLION, color_to_hex
from pdtui.sessions.comparison.session_comparison import SessionComparison
from pdtui.sessions.drive_path import DrivePath
from pdtui.sessions.session_header import SessionHeader

MOST_ATTRIBUTES = 4


def draw_session_comparison(
    target: Path,
    headers: tuple[SessionHeader, SessionHeader],
    courses: tuple[DrivePath, DrivePath],
    result: SessionComparison,
) -> None:
    """Draw the paths of two sessions, and over time the attributes that differ most in the end.

    What both have in common is gray; the first step that differs is a dot and a line. An attribute is ranked
    by its mean deviation in shares of its standard deviation.

    Raises:
        PictureError: The file cannot be written.
    """
    info = headers[0].info
    first = result.first_difference
    names = [attribute.name for attribute in info.attributes]
    spread = np.nanstd(np.concatenate([course.attributes for course in courses]), axis=0) + 1e-12
    ranked = sorted(result.deviations, key=lambda row: -row.mean / float(spread[names.index(row.attribute)]))
    shown = [names.index(row.attribute) for row in ranked[:MOST_ATTRIBUTES]] or list(
        range(min(MOST_ATTRIBUTES, len(names)))
    )
    title = " and ".join(header.path.stem for header in headers)
    has_path = all(len(course.places) for course in courses)
    with open_figure_page(target, 1.5 + 0.9 * len(shown), title) as figure:
        grid = figure.add_gridspec(len(shown), 2 if has_path else 1)
        if has_path:
            path = figure.add_subplot(grid[:, 0])
            path.set_aspect("equal", adjustable="datalim")
            path.set_xlabel("x (m)")
            path.set_ylabel("y (m)")
            path.set_title("path from above")
        plots = [figure.add_subplot(grid[row, -1]) for row in range(len(shown))]
        labels = [header.path.stem for header in headers]
        for course, color, label in zip(courses, (BLUE, VERMILLION), labels, strict=True):
            split = len(course.steps) if first is None else int(np.searchsorted(course.steps, first))
            if has_path:
                cut = len(course.places) if first is None else int(np.searchsorted(course.pose_steps, first))
                path.plot(*course.places[: cut + 1, :2].T, color=color_to_hex(GRAY))
                path.plot(*course.places[cut:, :2].T, color=color_to_hex(color), label=label)
                path.plot(*course.places[min(cut, len(course.places) - 1), :2], "o", color="black", ms=3)
            for axes, column in zip(plots, shown, strict=True):
                attribute = info.attributes[column]
                times = (course.steps + 1) * info.dt
                values = course.attributes[:, column]
                axes.plot(times[:split], values[:split], color=color_to_hex(GRAY))
                axes.plot(times[split:], values[split:], color=color_to_hex(color), label=label)
                axes.set_title(attribute.name + (f" ({attribute.unit})" if attribute.unit else ""))
                if first is not None:
                    axes.axvline((first + 1) * info.dt, color=color_to_hex(GRAY), linewidth=0.5)
        plots[-1].set_xlabel("time (s)")
        (path if has_path else plots[0]).legend(loc="best")
