"""How a robot crosses parkour courses alone and with an operator, and how it passes each kind of obstacle.

The paper shows a biped that a person drives over such a course. Both conditions run on the same courses. A
robot that falls or crashes begins anew behind the last obstacle that it passed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import PdtuiError, SessionError
from pdtui.core.processes.worker_pool import StepProgress, WorkerPool
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.paper.parkour.course_drive import (
    PARKOUR,
    CourseScore,
    drive_through_course,
    read_course_score,
    record_course,
    require_parkour_run,
)
from pdtui.paper.parkour.course_operator import CourseOperator
from pdtui.paper.parkour.course_results import (
    CourseCondition,
    CourseConditionSummary,
    CourseExperimentResult,
    ObstaclePassage,
    summarize_course_condition,
    summarize_passages,
)
from pdtui.robots import robot_file_stem
from pdtui.robots.parkour.parkour_course import OBSTACLE_KINDS, ObstacleKind

CONDITIONS: dict[CourseCondition, str] = {"alone": "alone", "operator": "with an operator"}
PERSON = "with a person"
STEPS = 5000
"""Control steps per course: 100 s, of which a crossing takes about 60 s."""
OBSTACLE_STEPS = 750
"""Control steps for one obstacle: 15 s."""


def evaluate_parkour(
    config: DriveConfig,
    seeds: Sequence[int],
    *,
    conditions: Sequence[CourseCondition] = tuple(CONDITIONS),
    sessions: Sequence[Path] = (),
    steps: int = STEPS,
    obstacles: Sequence[ObstacleKind] = OBSTACLE_KINDS,
    record: Path | None = None,
    workers: int = 2,
    progress: StepProgress | None = None,
) -> CourseExperimentResult:
    """Measure the conditions on the same courses, each kind of obstacle by itself, and recorded drives.

    Args:
        config: robot, map and policy; its seed and start are not used.
        seeds: seeds of the courses.
        conditions: conditions to measure.
        sessions: a person's drives.
        steps: largest number of control steps per course.
        obstacles: kinds of obstacles that are also attempted by themselves.
        record: folder for the operator's drives, each a session and a keystroke file.

    Raises:
        PdtuiError: the robot, policy or map cannot be loaded or lacks what is needed, or a session cannot be
            scored.
    """
    if others := [one for one in conditions if one not in CONDITIONS]:
        raise PdtuiError(f"parkour has the conditions {', '.join(CONDITIONS)}, found {others[0]}")
    config = replace(config, seed=0, start=PARKOUR)
    loop = build_control_loop(config)
    name, dt, policy = config.robot, loop.robot.control_dt, loop.policy.name
    require_parkour_run(loop)
    if "operator" in conditions:
        CourseOperator(loop.map, dt)
    people = [(path, *read_course_score(path, name, steps)) for path in sessions]
    if record is not None and (present := sorted(record.glob("*.rrd"))):
        raise SessionError(f"{present[0]}: already exists; drives are recorded into a new folder")
    jobs = [
        _CourseJob(config, seed, steps, one, record if one == "operator" else None)
        for one in CONDITIONS
        if one in conditions
        for seed in seeds
    ]
    passages = [
        _PassageJob(config, seed, one, kind)
        for one in CONDITIONS
        if one in conditions
        for kind in obstacles
        for seed in seeds
    ]
    total = len(jobs) + len(passages)
    with WorkerPool(f"courses of {name}", workers, _LoopCache(), _LoopCache) as pool:
        scores = pool.map(_run_course, jobs, lambda done, _: progress and progress(done, total))
        passed = pool.map(
            _run_passage, passages, lambda done, _: progress and progress(len(jobs) + done, total)
        )
    rows: list[CourseConditionSummary] = [
        summarize_course_condition(
            CONDITIONS[one],
            policy,
            [score for score, job in zip(scores, jobs, strict=True) if job.condition == one],
        )
        for one in CONDITIONS
        if one in conditions
    ]
    if people:
        driven = ", ".join(sorted({its_policy for _, _, its_policy in people}))
        rows.append(summarize_course_condition(PERSON, driven, [score for _, score, _ in people]))
    results = [
        ObstaclePassage(CONDITIONS[job.condition], job.kind, job.seed, done)
        for job, done in zip(passages, passed, strict=True)
    ]
    return CourseExperimentResult(
        name,
        tuple(seeds) if conditions else (),
        steps,
        steps * dt,
        tuple(rows),
        summarize_passages(results),
        tuple(map(str, sessions)),
    )


@dataclass(frozen=True)
class _CourseJob:
    """One course to cross; a folder records it."""

    config: DriveConfig
    seed: int
    steps: int
    condition: CourseCondition
    folder: Path | None


@dataclass(frozen=True)
class _PassageJob:
    """One obstacle to pass: the first of its kind on a course."""

    config: DriveConfig
    seed: int
    condition: CourseCondition
    kind: ObstacleKind


class _LoopCache:
    """The loop built last, since building one takes longer than a passage."""

    _built: tuple[DriveConfig, ControlLoop] | None = None

    def loop(self, config: DriveConfig, seed: int) -> ControlLoop:
        if self._built is None or self._built[0] != config:
            self._built = config, build_control_loop(config)
        built = self._built[1]
        return ControlLoop(built.robot, built.policy, built.map, seed, start=config.start)


def _run_course(loops: _LoopCache, job: _CourseJob) -> CourseScore:
    loop = loops.loop(job.config, job.seed)
    if job.condition == "alone":
        return drive_through_course(loop, job.steps)[0]
    operator = CourseOperator(loop.map, loop.robot.control_dt)
    if job.folder is None:
        return drive_through_course(loop, job.steps, operator)[0]
    path = job.folder / f"{robot_file_stem(job.config.robot)}-parkour-seed{job.seed}.rrd"
    return record_course(loop, job.steps, operator, path, job.config.activations)


def _run_passage(loops: _LoopCache, job: _PassageJob) -> bool:
    """Return whether the obstacle is passed in one attempt that begins before it."""
    loop = loops.loop(job.config, job.seed)
    run = require_parkour_run(loop)
    number = next(index for index, one in enumerate(run.course) if one.kind == job.kind)
    run.progress[0] = number
    loop.advance([DriveEvent(loop.step, "reset")])
    operator = CourseOperator(loop.map, loop.robot.control_dt) if job.condition == "operator" else None
    attempt = run.attempts
    drive_through_course(
        loop, OBSTACLE_STEPS, operator, until=lambda now: now.passed > number or now.attempts > attempt
    )
    return run.passed > number and run.attempts == attempt
