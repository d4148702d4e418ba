"""What `pdtui evaluate` measures one at a time: targets, a policy alone, its gait, and releases."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from pdtui.cli.output.command_output import print_result
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.console.progress_bar import progress_bar

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig


def print_target_tracking(
    config: DriveConfig, target: str, seeds: range, workers: Workers, as_json: bool
) -> None:
    """Measure how precisely targets of an attribute are held, and print it."""
    from pdtui.evaluation.evaluation_tables import tracking_table
    from pdtui.evaluation.target_tracking import evaluate_target_tracking

    with progress_bar("holding targets", quiet=as_json) as advance:
        result = evaluate_target_tracking(config, target, seeds, workers=workers, progress=advance)
    print_result(asdict(result), as_json, lambda: tracking_table(result))


def print_policy_alone(config: DriveConfig, seeds: range, as_json: bool, *, gait: bool) -> None:
    """Measure speed, return and outcomes of the policy alone, or else its gait, and print it."""
    from pdtui.evaluation.evaluation_tables import policy_evaluation_table
    from pdtui.evaluation.gait.gait_evaluation import evaluate_gait
    from pdtui.evaluation.gait.gait_tables import gait_tables
    from pdtui.evaluation.policy_evaluation import evaluate_policy

    with progress_bar("walking" if gait else "evaluating", quiet=as_json) as advance:
        if gait:
            walked = evaluate_gait(config, seeds, progress=advance)
        else:
            result = evaluate_policy(config, seeds, progress=advance)
    if gait:
        print_result(asdict(walked), as_json, lambda: gait_tables(walked))
    else:
        print_result(asdict(result), as_json, lambda: policy_evaluation_table(result))


def print_key_releases(
    config: DriveConfig, seeds: range, held: int | None, workers: Workers, journal: Path | None, as_json: bool
) -> None:
    """Measure what happens once each behavior is let go, and print it."""
    from pdtui.evaluation.key_release.key_release_evaluation import evaluate_key_releases
    from pdtui.evaluation.key_release.key_release_table import key_release_table

    with progress_bar("letting go", quiet=as_json) as advance:
        result = evaluate_key_releases(
            config, seeds, held=held, workers=workers, journal=journal, progress=advance
        )
    print_result(asdict(result), as_json, lambda: key_release_table(result))
