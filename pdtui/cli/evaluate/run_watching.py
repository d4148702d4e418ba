"""`pdtui evaluate --watch`: the best, the median and the worst seed of each behavior, on the screen."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from pdtui.cli.screen.show_drive import show_drive
from pdtui.core.printable_text import make_printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pdtui.evaluation.evaluation_plan import EvaluationPlan
    from pdtui.evaluation.ranked_runs import RankedRun


def watch_runs(plan: EvaluationPlan, runs: Sequence[RankedRun]) -> None:
    """Run every run again, and show them one after the other, as a replay is shown."""
    from pdtui.driving.session_replay import config_from_session
    from pdtui.evaluation.held_run import record_held_run
    from pdtui.sessions.session_header import read_session_header

    with TemporaryDirectory() as folder:
        for number, run in enumerate(runs):
            times, word = run.plan.times, "met" if run.met else "not met"
            told = f"{run.behavior}, {run.rank} seed {run.plan.seed}: {run.criterion}: {word}"
            pressed = f"pressed before step {times.press}, released {times.held} steps later"
            click.echo(make_printable(f"{told}; {pressed}"))
            if click.confirm("Watch it?", default=True):
                path = Path(folder) / f"{number}.rrd"
                record_held_run(plan.loop, run.plan, path)
                show_drive(config_from_session(read_session_header(path), str(path)), watching=True)
                path.unlink()
