"""`pdtui evaluate --let-go`: whether the robot stays up after each behavior is let go, and walks on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.processes.worker_pool import StepProgress, WorkerPool
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop, send_drive_files
from pdtui.evaluation.held_run import HeldRunPlan, HeldRunTrace, run_held_behavior
from pdtui.evaluation.journal.run_journal import RunJournal
from pdtui.evaluation.paired_statistics import share_interval
from pdtui.evaluation.protocol_settings import ProtocolSettings, RunTimes, plan_run_times

HELD_STEPS = 500
"""Control steps for which a behavior is held unless it has a period."""
FOLLOWED_STEPS = 300
"""Control steps after the release in which a fall counts."""
WALKS_ON = 0.5
"""Share of the speed without a press from which on a robot walks on."""
LAST_BINS = 8
"""Bins of a quarter of a second at the end over which the speed is averaged."""


@dataclass(frozen=True)
class KeyReleaseResult:
    """What happens once a behavior is let go.

    Attributes:
        behavior: Its name.
        held: Control steps for which it was held.
        failed_while_held: Runs that failed before the release.
        let_go: Runs that did not.
        failed: Those of them that failed within `FOLLOWED_STEPS` control steps after the release.
        low, high: 95 % interval of their share (Clopper and Pearson).
        failed_by_itself: Runs of the same seeds without a press that failed in these control steps, of those
            that had not failed before.
        by_itself: Number of these.
        walks_on: Runs with at least half the speed of the same seed without a press in the last 2 s; None
            for a robot without the attribute ``speed``.
    """

    behavior: str
    held: int
    failed_while_held: int
    let_go: int
    failed: int
    low: float
    high: float
    failed_by_itself: int
    by_itself: int
    walks_on: int | None


@dataclass(frozen=True)
class KeyReleaseEvaluation:
    """What happens once the behaviors of a map are let go."""

    robot: str
    policy: str
    seeds: tuple[int, ...]
    followed: int
    behaviors: tuple[KeyReleaseResult, ...]


def evaluate_key_releases(
    config: DriveConfig,
    seeds: Sequence[int],
    *,
    held: int | None = None,
    workers: Workers = 1,
    journal: Path | None = None,
    progress: StepProgress | None = None,
) -> KeyReleaseEvaluation:
    """Hold each behavior of a map, let it go, and watch for 300 control steps.

    It is pressed at the step that the seed draws, as `evaluate_behaviors` does. Behaviors of mode ``pid`` are
    left out: what they do depends on their target.

    Args:
        config: Robot, policy and map; its seed is not used.
        seeds: The seeds.
        held: Control steps for which behaviors without a period are held; None for `HELD_STEPS`.
        workers: Number of worker processes, or a cluster.
        journal: File that keeps the result of every run, and from which finished runs are taken.
        progress: Called with the number of runs done and of all runs.

    Raises:
        PdtuiError: The robot, policy, map or journal cannot be loaded.
    """
    loop = build_control_loop(config)
    names = [name for name, one in loop.map.behaviors.items() if one.pid is None]
    times = {
        (name, seed): _plan_times(loop, name, seed, held or HELD_STEPS) for name in names for seed in seeds
    }
    plans = [HeldRunPlan(name, seed, times[name, seed]) for name in names for seed in seeds]
    # One run without a press per seed, as long as the longest with one.
    longest = [max((times[name, seed] for name in names), key=lambda one: one.steps) for seed in seeds]
    plans += [HeldRunPlan("", seed, one) for seed, one in zip(seeds, longest, strict=True)]
    sent = send_drive_files(workers, config)
    with WorkerPool(f"evaluation of {config.robot}", workers, loop, build_control_loop, sent) as pool:
        kept = RunJournal(journal, loop).of(run_held_behavior)
        found = pool.map(run_held_behavior, plans, progress, kept)
    traces = {(plan.behavior, plan.seed): trace for plan, trace in zip(plans, found, strict=True)}
    attributes = [attribute.name for attribute in loop.robot.attributes]
    column = attributes.index("speed") if "speed" in attributes else None
    return KeyReleaseEvaluation(
        loop.robot.name,
        loop.policy.name,
        tuple(seeds),
        FOLLOWED_STEPS,
        tuple(summarize_key_release(name, seeds, times, traces, column) for name in names),
    )


def _plan_times(loop: ControlLoop, name: str, seed: int, held: int) -> RunTimes:
    dt, period = loop.robot.control_dt, loop.map.behaviors[name].period
    usual = plan_run_times(ProtocolSettings(), seed, dt)
    steps = held if period is None else max(1, round(period / dt))
    return RunTimes(usual.press, steps, FOLLOWED_STEPS, usual.window, usual.bin, dt)


def summarize_key_release(
    name: str,
    seeds: Sequence[int],
    times: Mapping[tuple[str, int], RunTimes],
    traces: Mapping[tuple[str, int], HeldRunTrace],
    column: int | None,
) -> KeyReleaseResult:
    """Return the figures of one behavior.

    Args:
        name: The behavior.
        seeds: The seeds.
        times: Times of each run by behavior and seed.
        traces: Its run by behavior and seed; that without a press has an empty name.
        column: Column of the attribute ``speed``; None if there is none.
    """
    held = times[name, seeds[0]].held
    ends = [_failed_at(traces[name, seed]) for seed in seeds]
    alone = [_failed_at(traces["", seed]) for seed in seeds]
    let_go = [end for end in ends if end is None or end >= held]
    failed = sum(end is not None for end in let_go)
    by_itself = [end for end in alone if end is None or end >= held]
    low, high = share_interval(failed, len(let_go)) if let_go else (float("nan"), float("nan"))
    return KeyReleaseResult(
        name,
        held,
        len(seeds) - len(let_go),
        len(let_go),
        failed,
        low,
        high,
        sum(end is not None and end < held + FOLLOWED_STEPS for end in by_itself),
        len(by_itself),
        None
        if column is None
        else sum(_walks_on(traces[name, seed], traces["", seed], column) for seed in seeds),
    )


def _failed_at(trace: HeldRunTrace) -> int | None:
    """Return the control steps from the press to the failure; None if there was none."""
    return trace.ended_at if trace.failed else None


def _walks_on(trace: HeldRunTrace, default: HeldRunTrace, column: int) -> bool:
    speed = float(np.mean(trace.values[-LAST_BINS:, column]))
    return speed >= WALKS_ON * float(np.nanmean(default.values[:, column]))
