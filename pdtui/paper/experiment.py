"""What an experiment of the paper declares, so that `pdtui evaluate --experiment` finds and runs it.

A new experiment is a module of this package whose name ends in ``_experiment`` and that defines
`EXPERIMENT`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import pdtui.paper
from pdtui.core.cluster.ray_cluster import Workers

if TYPE_CHECKING:
    from rich.console import RenderableType

    from pdtui.driving.drive_config import DriveConfig


@dataclass(frozen=True)
class ExperimentRequest:
    """What the user asks of an experiment.

    Attributes:
        configs: robot, map and policy of each map to measure.
        pictures, overwrite: picture files to write, and whether they may replace existing ones.
        options: those of the experiment's own options that were given, by parameter name.
    """

    configs: Sequence[DriveConfig]
    seeds: range
    workers: Workers
    pictures: tuple[Path, ...] = ()
    overwrite: bool = False
    options: Mapping[str, Any] = field(default_factory=dict)
    progress: Callable[[int, int], None] | None = None


@dataclass(frozen=True)
class ExperimentReport:
    """What ``--json`` prints, the table that is printed otherwise, and the files of the pictures."""

    data: dict[str, Any] | list[dict[str, Any]]
    table: RenderableType
    pictures: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Experiment:
    """One experiment.

    Attributes:
        name: the value of ``--experiment``.
        progress_label: label of the progress bar.
        run: runs the experiment.
        options: options of `pdtui evaluate` that only this experiment takes.
        takes_several_maps: whether it measures more than one map.
        draws_pictures: whether it takes ``-o``.
    """

    name: str
    progress_label: str
    run: Callable[[ExperimentRequest], ExperimentReport]
    options: tuple[click.Option, ...] = ()
    takes_several_maps: bool = False
    draws_pictures: bool = False


SESSION_OPTION = click.Option(
    ["--session", "sessions"],
    multiple=True,
    type=click.Path(path_type=Path),
    help="Score a recorded drive; may be repeated. Anything else is then measured only where it is named "
    "(--condition, --control).",
)
RECORD_OPTION = click.Option(
    ["--record"],
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Record the operator's drives with keys, each as a session and a keystroke file.",
)
REPEATS_OPTION = click.Option(
    ["--repeats"], type=click.IntRange(1), metavar="N", help="Number of repeats.  [default: 5]"
)
STEPS_OPTION = click.Option(
    ["--steps"],
    type=click.IntRange(1),
    metavar="N",
    help="Longest drive, in control steps.  [default: 2400 in the forest, 5000 for parkour]",
)
CONDITION_OPTION = click.Option(
    ["--condition", "conditions"],
    multiple=True,
    type=click.Choice(["alone", "operator", "placebo", "vision"]),
    help="Measure only this condition; may be repeated. Parkour has only the first two.  [default: all]",
)
"""Options that several experiments take."""


def list_experiments() -> dict[str, Experiment]:
    """Return all experiments of this package by name."""
    names = [module.name for module in pkgutil.iter_modules(pdtui.paper.__path__)]
    modules = [import_module(f"pdtui.paper.{name}") for name in names if name.endswith("_experiment")]
    return {module.EXPERIMENT.name: module.EXPERIMENT for module in modules}
