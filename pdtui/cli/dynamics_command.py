"""`pdtui dynamics`: units followed through the checkpoints of training runs."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.completion.completed_names import complete_robots
from pdtui.cli.options.shared_options import (
    FILE_PATH,
    integer_option,
    json_option,
    overwrite_option,
    preset_option,
)
from pdtui.cli.output.command_output import print_result
from pdtui.core.console.progress_bar import progress_bar


@click.command()
@click.argument("robot", shell_complete=complete_robots)
@click.argument("folders", nargs=-1, required=True, type=FILE_PATH, metavar="FOLDER...")
@preset_option
@integer_option("--every", default=1, help="Measure every N-th checkpoint, and the last.")
@click.option(
    "-o",
    "--output",
    "pictures",
    multiple=True,
    type=FILE_PATH,
    metavar="FILE",
    help="Draw a picture: .png, .svg, .pdf or .rrd; may be repeated.",
)
@overwrite_option
@json_option
def dynamics_command(
    robot: str,
    folders: tuple[Path, ...],
    preset: str,
    every: int,
    pictures: tuple[Path, ...],
    overwrite: bool,
    as_json: bool,
) -> None:
    """Follow the motor primitives of ROBOT's policy through its training.

    As in figure 5 of the paper. FOLDER is a run of `pdtui train --checkpoints`; give several for runs with
    other seeds. Measurements are kept there, so that an interrupted run can be continued.
    """
    from pdtui.pictures.picture_paths import check_picture_paths
    from pdtui.pictures.studies.learning_course import draw_learning_course
    from pdtui.robots import require_robot_name
    from pdtui.spectra.matching_presets import find_matching_preset
    from pdtui.study.dynamics.checkpoint_measurement import measure_learning_dynamics
    from pdtui.study.dynamics.dynamics_summary import build_learning_course
    from pdtui.study.dynamics.learning_dynamics import DynamicsSettings

    check_picture_paths(pictures, overwrite)
    name, settings = require_robot_name(robot), DynamicsSettings(find_matching_preset(preset))
    runs = []
    for folder in folders:
        with progress_bar(f"checkpoints of {folder.name}", quiet=as_json) as advance:
            runs.append(measure_learning_dynamics(name, folder, settings, every=every, progress=advance))
    shown = build_learning_course(runs)
    draw_learning_course(pictures, shown)
    print_result(dict(shown.summary), as_json, lambda: shown.table)
    if pictures and not as_json:
        click.echo(f"wrote {', '.join(map(str, pictures))}")
