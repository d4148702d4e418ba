"""`pdtui evaluate metadrive --experiment driving`: the paper's main experiment, human-AI shared control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pdtui.paper.experiment import (
    RECORD_OPTION,
    REPEATS_OPTION,
    SESSION_OPTION,
    Experiment,
    ExperimentReport,
    ExperimentRequest,
)

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig

POLICIES = ("metadrive", "metadrive-sac", "metadrive-relu", "metadrive-deep", "metadrive-expert")
"""Maps of the policies that are compared where the first one is asked for alone."""


def run_driving_experiment(request: ExperimentRequest) -> ExperimentReport:
    """Measure the rows asked for, and draw them; only sessions are scored where just those are given.

    Raises:
        PdtuiError: As `evaluate_driving`, or a picture cannot be written.
    """
    from pdtui.paper.driving.driving_conditions import evaluate_driving
    from pdtui.paper.driving.driving_results import CONTROL_NAMES, driving_table
    from pdtui.paper.driving.road_trajectories import draw_trajectories
    from pdtui.pictures.picture_paths import check_picture_paths

    check_picture_paths(request.pictures, request.overwrite)
    options = dict(request.options)
    options.setdefault("controls", () if "sessions" in options else tuple(CONTROL_NAMES))
    configs, left_out = list_compared(request.configs)
    result = evaluate_driving(
        configs, left_out=left_out, workers=request.workers, progress=request.progress, **options
    )
    table = driving_table(result)
    draw_trajectories(request.pictures, configs[0], result)
    data = {**asdict(result), "pictures": [str(path) for path in request.pictures]}
    return ExperimentReport(data, table, request.pictures)


def list_compared(given: Sequence[DriveConfig]) -> tuple[list[DriveConfig], dict[str, str]]:
    """Return the drives of all policies of the table, and why others are left out.

    Several maps, or one that is not the car's own, are compared as they are; a map that is given twice
    counts once.
    """
    from dataclasses import replace

    from pdtui.core.errors import PdtuiError
    from pdtui.stimulation.map_library import find_map
    from pdtui.stimulation.map_policy_lookup import resolve_map_policy
    from pdtui.stimulation.map_reader import load_map

    maps = {(Path(one.stimulation_map.source).stem, one.stimulation_map.text): one for one in reversed(given)}
    given = list(reversed(maps.values()))
    first = given[0]
    if len(given) > 1 or Path(first.stimulation_map.source).stem != POLICIES[0] or first.policy:
        return list(given), {}
    configs, left_out = [first], {}
    for name in POLICIES[1:]:
        try:
            stimulation_map = resolve_map_policy(load_map(find_map(name)))
            configs.append(replace(first, stimulation_map=stimulation_map))
        except PdtuiError as error:
            left_out[name] = str(error)
    return configs, left_out


EXPERIMENT = Experiment(
    "driving",
    "driving",
    run_driving_experiment,
    (
        click.Option(
            ["--control", "controls"],
            multiple=True,
            type=click.Choice(["alone", "keys", "takeover", "human only"]),
            help="Measure only this way to share control; may be repeated.  [default: all]",
        ),
        click.Option(
            ["--scene", "scenes"],
            multiple=True,
            metavar="START",
            help="Drive only through this scene; may be repeated.  [default: test-0 to test-19]",
        ),
        REPEATS_OPTION,
        SESSION_OPTION,
        RECORD_OPTION,
        click.Option(
            ["--journal"],
            type=click.Path(path_type=Path, dir_okay=False),
            metavar="FILE",
            help="Keep the score of each finished drive, and do not drive again what is there already.",
        ),
    ),
    takes_several_maps=True,
    draws_pictures=True,
)
