"""Runs the matching study over the policies that are there, and continues one that was interrupted."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.errors import StudyError
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.weights_header import hash_file
from pdtui.study.matching.matching_study_plan import MatchingStudyPlan, StudiedPolicy
from pdtui.study.matching.policy_measurement import measure_studied_policy
from pdtui.study.matching.study_data import (
    MatchingStudyData,
    merge_study_data,
    read_study_data,
    write_study_data,
)

JOURNAL = "rollouts.sqlite"


def find_trained_policies(
    plan: MatchingStudyPlan, folder: Path
) -> tuple[dict[StudiedPolicy, Path], list[StudiedPolicy]]:
    """Return the weights of the plan's policies that were trained to the end, and the other policies."""
    own = {one: folder / one.name / "best.safetensors" for one in plan.policies if not one.shipped}
    found = {one: path for one, path in own.items() if _is_trained(path, one.steps)}
    found |= {one: find_weights_file(one.robot) for one in plan.policies if one.shipped}
    found = {one: found[one] for one in plan.policies if one in found}
    return found, [one for one in plan.policies if one not in found]


def _is_trained(weights: Path, steps: int) -> bool:
    """Return whether the last evaluation of a training run came at its last control step."""
    try:
        lines = weights.with_name("log.jsonl").read_text().splitlines()
        return weights.is_file() and bool(lines) and int(json.loads(lines[-1])["steps"]) >= steps
    except (OSError, ValueError, KeyError, TypeError):
        return False


def run_matching_study(
    plan: MatchingStudyPlan,
    policies: Path,
    folder: Path,
    *,
    workers: Workers = 1,
    only_finished: bool = False,
    progress: Callable[[int, int, str], None] | None = None,
) -> MatchingStudyData:
    """Measure the policies of a plan that were trained below a folder, one after the other.

    What is finished is kept in `folder`, so that a study that was interrupted goes on.

    Args:
        plan: The plan.
        policies: Folder in which the folder of each policy is.
        folder: Folder of the parts and of the journal.
        workers: Number of worker processes, or a cluster.
        only_finished: Measure nothing, and return what earlier runs measured.
        progress: Is told the policies measured, those to measure, and what is done now.

    Raises:
        StudyError: There is no trained policy, or none was measured and nothing shall be.
        PdtuiError: A policy cannot be measured.
    """
    trained, missing = find_trained_policies(plan, policies)
    if not trained:
        example = missing[0].command(str(policies)) if missing else "a plan with policies"
        raise StudyError(
            f"{policies}: expected trained policies of the plan, found none; begin with {example}"
        )
    parts: list[MatchingStudyData] = []
    for number, (policy, weights) in enumerate(trained.items()):
        path = folder / f"{policy.name}.parquet"
        part = _read_part(path, plan, weights)
        if part is None:
            if only_finished:
                continue

            def report(stage: str, done: int, total: int, at: int = number, name: str = policy.name) -> None:
                if progress is not None:
                    progress(at, len(trained), f"{name}: {stage} {done}/{total}")

            journal = folder / JOURNAL
            part = measure_studied_policy(plan, policy, weights, journal, workers=workers, progress=report)
            write_study_data(path, part)
            part = read_study_data(path)  # with the digits that the file keeps, as when it is read again
        parts.append(part)
        if progress is not None:
            progress(number + 1, len(trained), policy.name)
    if not parts:
        raise StudyError(f"{folder}: expected policies that were measured by this plan, found none")
    return merge_study_data(parts)


def _read_part(path: Path, plan: MatchingStudyPlan, weights: Path) -> MatchingStudyData | None:
    """Return what an earlier run measured of the same weights by the same plan, if it is there."""
    if not path.exists():
        return None
    try:
        part = read_study_data(path)
    except StudyError:
        return None
    same = part.plan == plan and [one.sha256 for one in part.policies] == [hash_file(weights)]
    return part if same else None
