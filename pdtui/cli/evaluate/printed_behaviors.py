"""The usual way of `pdtui evaluate`: every behavior of a map, beside the policy alone."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pdtui.cli.evaluate.run_watching import watch_runs
from pdtui.cli.output.command_output import describe_map_copy, print_result
from pdtui.cli.screen.show_drive import require_terminal
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.errors import MapError
from pdtui.core.printable_text import make_printable

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.evaluation.protocol_settings import ProtocolSettings


def print_behaviors(
    config: DriveConfig,
    seeds: range,
    settings: ProtocolSettings,
    workers: Workers,
    drawn: tuple[Path, bool] | None,
    *,
    journal: Path | None,
    watch: bool,
    update: bool,
    as_json: bool,
) -> None:
    """Measure the behaviors of a map, print the result, and draw or show runs if that was asked for.

    Raises:
        MapError: Effects are to be written into the map, but there is only one seed.
    """
    from pdtui.evaluation import behavior_evaluation as evaluation
    from pdtui.evaluation.behavior_tables import behavior_tables
    from pdtui.evaluation.ranked_runs import rank_runs
    from pdtui.pictures.behavior_strips import draw_strips, film_strips
    from pdtui.pictures.matplotlib_page import check_figure_path
    from pdtui.stimulation.map_library import user_map_path
    from pdtui.stimulation.map_writer import replace_effects, rewrite_map

    source = Path(config.stimulation_map.source)
    output = user_map_path(source) if update else source
    if update and len(seeds) < 2:
        raise MapError("--update needs at least 2 seeds: one seed gives no confidence interval")
    if drawn is not None:
        check_figure_path(*drawn)
    if watch:
        require_terminal()
    plan = evaluation.plan_evaluation(config, seeds, settings)
    if not as_json:
        where = f"{workers} processes" if isinstance(workers, int) else str(workers)
        click.echo(f"{evaluation.count_control_steps(plan):,} control steps, {where}", err=True)
    with progress_bar("evaluating", quiet=as_json) as advance:
        result = evaluation.evaluate_behaviors(
            config, plan, workers=workers, journal=journal, progress=advance
        )
    if update:
        measured = result.measured_effects()
        rewrite_map(source, lambda text: replace_effects(text, measured, str(source)), output)
        told = f"{output}: wrote the effects{describe_map_copy(source, output)}"
        click.echo(make_printable(told), err=True)
    print_result(asdict(result), as_json, lambda: behavior_tables(result))
    if drawn is not None:
        with progress_bar("filming", quiet=as_json) as advance:
            draw_strips(drawn[0], plan, film_strips(plan, rank_runs(plan, result), advance))
    if watch:
        watch_runs(plan, rank_runs(plan, result))
