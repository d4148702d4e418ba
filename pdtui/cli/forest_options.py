"""`pdtui evaluate --experiment forest`: its options, and what they ask for."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.shared_options import core_count, progress_bar_or_none, show_result

if TYPE_CHECKING:
    from pdtui.cli.experiment_commands import ExperimentRequest


def forest_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options that only ``--experiment forest`` has, given to the command as `forest`."""

    @wraps(command)
    def asking(
        *args: Any,
        steps: int | None,
        repeats: int | None,
        conditions: tuple[str, ...],
        sessions: tuple[Path, ...],
        record: Path | None,
        **others: Any,
    ) -> Any:
        given = {
            "steps": steps,
            "repeats": repeats,
            "conditions": conditions,
            "sessions": sessions,
            "record": record,
        }
        return command(*args, forest={name: value for name, value in given.items() if value}, **others)

    for option in (
        click.option(
            "--record",
            type=click.Path(path_type=Path, file_okay=False),
            metavar="FOLDER",
            help="Forest: record the operator's drives, each as a session and a keystroke file.",
        ),
        click.option(
            "--session",
            "sessions",
            multiple=True,
            type=click.Path(path_type=Path),
            help="Forest: score a person's recorded drive; several make a mean. Conditions are then "
            "measured only where --condition names them.",
        ),
        click.option(
            "--condition",
            "conditions",
            multiple=True,
            type=click.Choice(["alone", "operator", "vision"]),
            help="Forest: measure only these.  [default: all]",
        ),
        click.option(
            "--repeats",
            type=click.IntRange(1),
            help="Forest: into which seeds are divided.  [default: 5]",
        ),
        click.option(
            "--steps",
            type=click.IntRange(1),
            help="Forest: control steps an episode lasts at most.  [default: 2400]",
        ),
    ):
        asking = option(asking)
    return asking


def evaluate_in_forest(asked: ExperimentRequest) -> None:
    from pdtui.paper.forest_experiment import CONDITIONS, evaluate_forest
    from pdtui.paper.paper_tables import forest_table

    if len(asked.configs) > 1 or asked.outputs:
        raise click.UsageError("--experiment forest takes one map and draws no pictures")
    options = dict(asked.forest)
    options.setdefault("conditions", () if "sessions" in options else tuple(CONDITIONS))
    with progress_bar_or_none("through the forest", quiet=asked.as_json) as advance:
        result = evaluate_forest(
            asked.configs[0], asked.seeds, workers=core_count(asked.workers), progress=advance, **options
        )
    show_result(result.as_dict(), asked.as_json, lambda: forest_table(result))
