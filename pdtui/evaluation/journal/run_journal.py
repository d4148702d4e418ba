"""The journal of an evaluation's runs, with which an interrupted evaluation goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pdtui.core.outcome import Outcome
from pdtui.core.processes.result_journal import (
    Job,
    KeyedResultJournal,
    Result,
    ResultJournal,
    decode_array,
    encode_array,
)
from pdtui.driving.control_loop import ControlLoop
from pdtui.evaluation.behavior_substitutes import InterventionSize
from pdtui.evaluation.held_run import HeldRunTrace, InterventionMeasurement
from pdtui.evaluation.tasks.task_runs import TaskRunResult
from pdtui.robots.simulators.python_state import digest_values
from pdtui.robots.task import TaskVerdict
from pdtui.sessions.environment_versions import collect_versions

RunResult = HeldRunTrace | InterventionMeasurement | TaskRunResult


class RunJournal:
    """Keeps what was found in each run of an evaluation.

    A run is determined by the robot with its options, the weights and how they are read, the map's text, the
    versions of everything that computes, and its plan. What is asked for a second time is read instead of
    driven.

    Args:
        path: The file; None keeps nothing.
        loop: Robot, policy and map.

    Raises:
        PdtuiError: The file cannot be read or written, or holds something else.
    """

    def __init__(self, path: Path | None, loop: ControlLoop) -> None:
        self._results: ResultJournal[Any] = ResultJournal(path, _encode, _decode, "the result of a run")
        robot, policy = loop.robot, loop.policy
        self._identity = digest_values(
            robot.name,
            dict(robot.build_options),
            policy.sha256,
            loop.map.import_options.identify(),
            loop.map.text,
            collect_versions(),
        )

    def of(self, function: Callable[[ControlLoop, Job], Result]) -> KeyedResultJournal[Job, Result]:
        """Return the journal of the runs that a function does."""
        return KeyedResultJournal(
            self._results, lambda job: f"{function.__name__} {digest_values(self._identity, job):016x}"
        )


def _encode(result: RunResult) -> dict[str, Any]:
    if isinstance(result, HeldRunTrace):
        return {
            "values": encode_array(result.values),
            "places": encode_array(result.places),
            "outcome": result.outcome,
            "ended_at": result.ended_at,
        }
    if isinstance(result, InterventionMeasurement):
        size = result.size
        return {
            "size": None if size is None else [list(size.layers.items()), size.action],
            "spread": encode_array(result.observation_spread),
        }
    return {
        "verdict": asdict(result.verdict),
        "outcome": result.outcome,
        "still": None if result.still is None else asdict(result.still),
        "reached_press": result.reached_press,
    }


def _decode(fields: Mapping[str, Any]) -> RunResult:
    if "spread" in fields:
        size = fields["size"]
        measured = None if size is None else InterventionSize(dict(size[0]), tuple(size[1]))
        return InterventionMeasurement(measured, decode_array(fields["spread"]))
    outcome = None if fields["outcome"] is None else Outcome(fields["outcome"])
    if "values" in fields:
        values, places = decode_array(fields["values"]), decode_array(fields["places"])
        return HeldRunTrace(values, places, outcome, fields["ended_at"])
    still = None if fields["still"] is None else TaskVerdict(**fields["still"])
    return TaskRunResult(TaskVerdict(**fields["verdict"]), outcome, still, fields["reached_press"])
