"""`pdtui study`: studies over many policies."""

from __future__ import annotations

from pathlib import Path

import click

from pdtui.cli.options.shared_options import FILE_PATH, json_option, overwrite_option
from pdtui.cli.options.worker_options import workers_option
from pdtui.cli.output.command_output import print_result
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.console.progress_bar import progress_bar


@click.group()
def study_command() -> None:
    """Study many policies."""


@study_command.command("matching")
@click.option(
    "--policies",
    type=FILE_PATH,
    default=Path("runs/study"),
    show_default=True,
    metavar="FOLDER",
    help="Folder of the trained policies.",
)
@click.option(
    "--folder",
    type=FILE_PATH,
    default=Path("runs/matching-study"),
    show_default=True,
    metavar="FOLDER",
    help="Folder of the measurements.",
)
@click.option(
    "--plan",
    "plan_path",
    type=FILE_PATH,
    metavar="FILE",
    help="Plan of the study; default: the plan of the guide's page.",
)
@click.option("--data", type=FILE_PATH, metavar="FILE", help="Analyze these data instead of measuring.")
@click.option(
    "--guide", type=FILE_PATH, metavar="FOLDER", help="Write the page and its figures into this folder."
)
@click.option("--so-far", is_flag=True, help="Analyze the policies measured so far; measure no other.")
@click.option("--list", "only_list", is_flag=True, help="List the policies of the plan; measure nothing.")
@workers_option
@overwrite_option
@json_option
def study_matching_command(
    policies: Path,
    folder: Path,
    plan_path: Path | None,
    data: Path | None,
    guide: Path | None,
    so_far: bool,
    only_list: bool,
    workers: Workers,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Test whether the unit that matches an attribute steers it, and score how policies walk and are steered.

    A plan says which policies are wanted, and how they are measured and judged. A study that was interrupted
    goes on when the same command is run again.
    """
    from pdtui.study.matching.matching_study import find_trained_policies, run_matching_study
    from pdtui.study.matching.matching_study_plan import MATCHING_STUDY_PLAN, load_matching_study_plan
    from pdtui.study.matching.study_data import read_study_data, write_study_data
    from pdtui.study.matching.study_page import check_page_files, write_study_page
    from pdtui.study.matching.study_statistics import analyze_study
    from pdtui.study.matching.study_tables import StudySummary, list_policies

    if only_list:
        plan = load_matching_study_plan(plan_path or MATCHING_STUDY_PLAN)
        found, missing = find_trained_policies(plan, policies)
        listed = list_policies(found, missing, str(policies))
        print_result(listed.as_list(), as_json, listed.table)
        return
    if guide is not None:
        check_page_files(guide, overwrite)
    written: list[Path] = []
    if data is not None:
        measured = read_study_data(data)
    else:
        plan = load_matching_study_plan(plan_path or MATCHING_STUDY_PLAN)
        with progress_bar("policies", quiet=as_json) as advance:
            measured = run_matching_study(
                plan, policies, folder, workers=workers, only_finished=so_far, progress=advance
            )
        written.append(folder / "matching-study.parquet")
        write_study_data(written[0], measured)
    result = analyze_study(measured)
    if guide is not None:
        written += write_study_page(measured, result, guide)
    summary = StudySummary(measured, result)
    print_result(summary.as_dict(), as_json, summary.tables)
    if not as_json:
        click.echo(summary.answer)
        if written:
            click.echo(f"wrote {', '.join(map(str, written))}")
