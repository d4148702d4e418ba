"""The paper's experiments, as `pdtui evaluate --experiment` runs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.common import cores, progress_bar_or_none, show_result
from pdtui.cli.forest import evaluate_in_forest

if TYPE_CHECKING:
    from pdtui.experiments.precision import Precision
    from pdtui.pictures.steering import Headings
    from pdtui.teleop.order import DriveOrder


@dataclass(frozen=True)
class Asked:
    """What the command line asks of an experiment.

    Attributes:
        orders: robots, maps and policies to compare.
        seeds: of the drives.
        workers: processes; None for one a core.
        as_json: print JSON.
        outputs: pictures to write.
        overwrite: whether they may replace files.
        forest: options of the forest that were given, by name.
    """

    orders: Sequence[DriveOrder]
    seeds: range
    workers: int | None
    as_json: bool
    outputs: tuple[Path, ...] = ()
    overwrite: bool = False
    forest: Mapping[str, Any] = field(default_factory=dict)


def _tracking(asked: Asked) -> None:
    from pdtui.experiments.precision import evaluate_precision
    from pdtui.experiments.steering_tables import precision_table
    from pdtui.pictures.steering import check_pictures, draw_pictures

    check_pictures(asked.outputs, asked.overwrite)
    with progress_bar_or_none("holding headings", quiet=asked.as_json) as advance:
        result = evaluate_precision(asked.orders, asked.seeds, workers=cores(asked.workers), progress=advance)
    draw_pictures(asked.outputs, _headings(result))
    pictures = [str(path) for path in asked.outputs]
    show_result({**result.as_dict(), "pictures": pictures}, asked.as_json, lambda: precision_table(result))
    if pictures and not asked.as_json:
        click.echo(f"wrote {', '.join(pictures)}")


def _commands(asked: Asked) -> None:
    from pdtui.experiments.commands import evaluate_commands
    from pdtui.experiments.tables import commands_table

    for order in asked.orders:
        with progress_bar_or_none("following commands", quiet=asked.as_json) as advance:
            result = evaluate_commands(order, asked.seeds, progress=advance)
        show_result(result.as_dict(), asked.as_json, partial(commands_table, result))


def _headings(result: Precision) -> Headings:
    """What pictures show of it."""
    import numpy as np

    from pdtui.experiments.following import STEPS_EACH
    from pdtui.experiments.steering_tables import precision_table
    from pdtui.pictures.steering import Headings, Held

    several = len({row.map for row in result.rows}) > 1
    held = []
    for row in result.rows:
        figures = row.tracking
        falls = f", {figures.falls} of {len(figures.seeds)} fell" if figures.falls else ""
        name = f"{figures.behavior} ({row.policy})" if several else figures.behavior
        held.append(Held(name, f"{figures.error:.3f} rad{falls}", row.values))
    robots = ", ".join(dict.fromkeys(row.robot for row in result.rows))
    return Headings(
        f"Holding headings: {robots}",
        np.repeat(np.array(result.targets), STEPS_EACH),
        result.dt,
        tuple(held),
        precision_table(result),
        result.as_dict(),
    )


EXPERIMENTS: dict[str, Callable[[Asked], None]] = {
    "tracking": _tracking,
    "forest": evaluate_in_forest,
    "commands": _commands,
}
"""By the name that ``--experiment`` takes."""
