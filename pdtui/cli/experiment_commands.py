"""The paper's experiments, as `pdtui evaluate --experiment` runs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.forest_options import evaluate_in_forest
from pdtui.cli.shared_options import core_count, progress_bar_or_none, show_result

if TYPE_CHECKING:
    from pdtui.drive.drive_config import DriveConfig
    from pdtui.paper.unit_vs_command import UnitCommandComparison
    from pdtui.pictures.heading_figures import HeadingFigure


@dataclass(frozen=True)
class ExperimentRequest:
    """What the command line asks of an experiment.

    Attributes:
        configs: robots, maps and policies to compare.
        seeds: of the drives.
        workers: processes; None for one a core.
        as_json: print JSON.
        outputs: pictures to write.
        overwrite: whether they may replace files.
        forest: options of the forest that were given, by name.
    """

    configs: Sequence[DriveConfig]
    seeds: range
    workers: int | None
    as_json: bool
    outputs: tuple[Path, ...] = ()
    overwrite: bool = False
    forest: Mapping[str, Any] = field(default_factory=dict)


def _tracking(asked: ExperimentRequest) -> None:
    from pdtui.paper.paper_tables import precision_table
    from pdtui.paper.unit_vs_command import compare_unit_with_command
    from pdtui.pictures.heading_figures import check_heading_pictures, draw_heading_pictures

    check_heading_pictures(asked.outputs, asked.overwrite)
    with progress_bar_or_none("holding headings", quiet=asked.as_json) as advance:
        result = compare_unit_with_command(
            asked.configs, asked.seeds, workers=core_count(asked.workers), progress=advance
        )
    draw_heading_pictures(asked.outputs, _headings(result))
    pictures = [str(path) for path in asked.outputs]
    show_result({**result.as_dict(), "pictures": pictures}, asked.as_json, lambda: precision_table(result))
    if pictures and not asked.as_json:
        click.echo(f"wrote {', '.join(pictures)}")


def _commands(asked: ExperimentRequest) -> None:
    from pdtui.paper.command_following import evaluate_commands
    from pdtui.paper.paper_tables import commands_table

    for config in asked.configs:
        with progress_bar_or_none("following commands", quiet=asked.as_json) as advance:
            result = evaluate_commands(config, asked.seeds, progress=advance)
        show_result(result.as_dict(), asked.as_json, partial(commands_table, result))


def _headings(result: UnitCommandComparison) -> HeadingFigure:
    """What pictures show of it."""
    import numpy as np

    from pdtui.paper.paper_tables import precision_table
    from pdtui.pictures.heading_figures import HeadingFigure, TrackedHeading
    from pdtui.search.tracking_drives import STEPS_EACH

    several = len({row.map for row in result.rows}) > 1
    held = []
    for row in result.rows:
        figures = row.tracking
        falls = f", {figures.falls} of {len(figures.seeds)} fell" if figures.falls else ""
        name = f"{figures.behavior} ({row.policy})" if several else figures.behavior
        held.append(TrackedHeading(name, f"{figures.error:.3f} rad{falls}", row.values))
    robots = ", ".join(dict.fromkeys(row.robot for row in result.rows))
    return HeadingFigure(
        f"Holding headings: {robots}",
        np.repeat(np.array(result.targets), STEPS_EACH),
        result.dt,
        tuple(held),
        precision_table(result),
        result.as_dict(),
    )


EXPERIMENTS: dict[str, Callable[[ExperimentRequest], None]] = {
    "tracking": _tracking,
    "forest": evaluate_in_forest,
    "commands": _commands,
}
"""By the name that ``--experiment`` takes."""
