"""`pdtui evaluate --watch`: the best, the median and the worst seed of each behavior, on the screen."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from pdtui.cli.drive_command import show_drive
from pdtui.core.printable_text import make_printable

if TYPE_CHECKING:
    from pdtui.evaluation.behavior_evaluation import MapEvaluation
    from pdtui.evaluation.evaluation_plan import EvaluationPlan


def watch_runs(plan: EvaluationPlan, result: MapEvaluation) -> None:
    """Run three seeds of each behavior again, and show them one after the other, as a replay is shown."""
    from pdtui.driving.session_replay import config_from_session
    from pdtui.evaluation.held_run import HeldRunPlan, record_held_run
    from pdtui.pictures.behavior_strips import pick_seeds
    from pdtui.sessions.session_header import read_session_header

    with TemporaryDirectory() as folder:
        for row in result.undisturbed():
            for rank, place in pick_seeds(row).items():
                seed, word = result.seeds[place], "met" if row.seed_met[place] else "not met"
                times = plan.times(row.behavior, seed)
                told = f"{row.behavior}, {rank} seed {seed}: {row.criterion}: {word}"
                pressed = f"pressed before step {times.press}, released {times.held} steps later"
                click.echo(make_printable(f"{told}; {pressed}"))
                if not click.confirm("Watch it?", default=True):
                    continue
                path = Path(folder) / f"{rank}-{place}-{len(row.behavior)}.rrd"
                record_held_run(plan.loop, HeldRunPlan(row.behavior, seed, times), path)
                header = read_session_header(path)
                show_drive(config_from_session(header, str(path)), watching=True)
                path.unlink()
