"""The journal of a search for a task, with which an interrupted search goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pdtui.core.processes.result_journal import KeyedResultJournal, ResultJournal
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.robots.robot import Robot
from pdtui.robots.simulators.python_state import digest_values
from pdtui.robots.task import TaskVerdict
from pdtui.search.task_rollout import StimulationWithDuration
from pdtui.sessions.environment_versions import collect_versions

PlanJudgingJob = tuple[str, tuple[StimulationWithDuration, ...], int, bool]
"""Name of the task, plans, seed of the walk before them, and whether they run one by one."""
VerdictJournal = KeyedResultJournal[PlanJudgingJob, list[TaskVerdict]]


def open_verdict_journal(
    path: Path, robot: Robot, policy: Policy, import_options: ImportOptions
) -> VerdictJournal:
    """Open a file of verdicts, one JSON object per line.

    A verdict is determined by the robot with its options, the weights and how they are read, the versions of
    everything that computes, and the plans that are judged together.

    Raises:
        PdtuiError: The file cannot be read or written, or holds something else.
    """
    identity = digest_values(
        robot.name, dict(robot.build_options), policy.sha256, import_options.identify(), collect_versions()
    )
    results = ResultJournal(path, _encode, _decode, "the verdicts on some plans")
    return KeyedResultJournal(results, lambda job: f"{job[0]} {job[2]} {digest_values(identity, job):016x}")


def _encode(verdicts: list[TaskVerdict]) -> dict[str, Any]:
    return {"verdicts": [asdict(one) for one in verdicts]}


def _decode(fields: Mapping[str, Any]) -> list[TaskVerdict]:
    return [TaskVerdict(**one) for one in fields["verdicts"]]
