"""Drives all policies through the test scenes: alone, with keys, with takeovers, and without a policy.

The paper's main experiment (section 4.1, Table 1): a policy that was trained on quiet roads meets traffic and
obstacles, and an operator shares control. All rows drive through the same scenes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.errors import PdtuiError, SessionError
from pdtui.core.processes.worker_pool import StepProgress, WorkerPool
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop, send_drive_files
from pdtui.paper.driving.drive_operators import SharedControl, make_operator
from pdtui.paper.driving.driving_episode import (
    TEST_STARTS,
    DrivingScore,
    drive_episode,
    read_episode,
    record_episode,
)
from pdtui.paper.driving.driving_results import (
    CONTROL_NAMES,
    DrivingExperimentResult,
    DrivingRow,
    compare_involvement,
    summarize_row,
)
from pdtui.paper.driving.driving_score_journal import DrivingScoreJournal, open_driving_score_journal
from pdtui.paper.driving.key_effects import (
    MEASURING_SEEDS,
    STRAIGHT,
    KeyEffects,
    driving_behaviors,
    measure_key_effects,
)
from pdtui.paper.driving.operator_memory import sample_judgment_errors
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import robot_file_stem
from pdtui.robots.robot import Robot

REPEATS = 5
"""Repeats of every row with an operator."""


def evaluate_driving(
    configs: Sequence[DriveConfig],
    *,
    controls: Sequence[SharedControl] = tuple(CONTROL_NAMES),
    scenes: Sequence[str] = TEST_STARTS,
    repeats: int = REPEATS,
    sessions: Sequence[Path] = (),
    left_out: Mapping[str, str] | None = None,
    journal: Path | None = None,
    record: Path | None = None,
    workers: Workers = 2,
    progress: StepProgress | None = None,
) -> DrivingExperimentResult:
    """Measure the rows of the table, and score recorded drives.

    Args:
        configs: Robot, map and policy of each policy; their seeds and starts are not used.
        controls: How control is shared.
        scenes: Starts of the episodes.
        repeats: Number of repeats of every row with an operator.
        sessions: People's drives.
        left_out: Policies that are not measured, and why.
        journal: File of scores that is written meanwhile, and from which finished drives are taken.
        record: Folder for the operator's drives with keys in the first repeat, each a session and a keystroke
            file.

    Raises:
        PdtuiError: A robot, policy or map cannot be loaded or lacks what is needed, or a session cannot be
            scored.
    """
    robot = configs[0].robot
    if unknown := sorted(set(scenes) - set(TEST_STARTS)):
        known = f"{TEST_STARTS[0]} to {TEST_STARTS[-1]}"
        raise PdtuiError(f"expected scenes of the experiment, {known}, found '{unknown[0]}'")
    read = [read_episode(path, robot) for path in sessions]
    if record is not None and (present := sorted(record.glob("*.rrd"))):
        raise SessionError(f"{present[0]}: already exists; drives are recorded into a new folder")
    kept, missing = open_driving_score_journal(journal), dict(left_out or {})
    effects: dict[str, KeyEffects] = {}
    rows: list[DrivingRow] = []
    sent = {_name(config): send_drive_files(workers, config) for config in configs}
    with WorkerPool(f"roads of {robot}", workers, _Car(), _Car) as pool:
        if controls:
            usable = []
            for config in configs:
                try:
                    if "keys" in controls:
                        driving_behaviors(config.stimulation_map)
                    usable.append(config)
                except PdtuiError as error:
                    missing[_name(config)] = str(error)
            if "keys" in controls:
                found = pool.map(_measure_keys, [sent[_name(config)] for config in usable])
                effects = {_name(config): one for config, one in zip(usable, found, strict=True)}
            jobs = list(_plan_jobs(usable, controls, scenes, repeats, effects, record))
            scores = _run_jobs(pool, jobs, sent, kept, progress)
            rows += _summarize(jobs, scores, repeats)
    rows += [
        summarize_row(
            policy, control, "person", [[score for score, *its in read if its == [policy, control]]]
        )
        for policy, control in dict.fromkeys((policy, control) for _, policy, control in read)
    ]
    return DrivingExperimentResult(
        robot,
        tuple(scenes) if controls else (),
        repeats,
        tuple(rows),
        compare_involvement(rows),
        effects,
        missing,
        tuple(map(str, sessions)),
    )


@dataclass(frozen=True)
class _DriveJob:
    """One drive.

    Attributes:
        policy: Name of the policy in the table; empty if it does not drive.
        folder: Folder to record it into; None records nothing.
    """

    config: DriveConfig
    policy: str
    control: SharedControl
    repeat: int
    scene: str
    effects: KeyEffects | None
    folder: Path | None = None

    @property
    def key(self) -> str:
        """Everything that determines the drive, as text."""
        text = self.config.stimulation_map.text if self.policy else ""
        digest = sha256(f"{text}\n{self.config.policy if self.policy else ''}".encode()).hexdigest()[:16]
        return f"{self.policy} {digest} {self.control} {self.repeat} {self.scene}"


class _Car:
    """A car, and the policies that have driven it."""

    def __init__(self) -> None:
        self._robot: Robot | None = None
        self._policies: dict[str, Policy] = {}

    def loop(self, config: DriveConfig, start: str, seed: int = 0) -> ControlLoop:
        """Return a drive before its first step."""
        name = config.policy or config.stimulation_map.policy
        loop = build_control_loop(
            replace(config, start=start, seed=seed), self._robot, self._policies.get(name)
        )
        self._robot, self._policies[name] = loop.robot, loop.policy
        return loop


def _plan_jobs(
    configs: Sequence[DriveConfig],
    controls: Sequence[SharedControl],
    scenes: Sequence[str],
    repeats: int,
    effects: Mapping[str, KeyEffects],
    record: Path | None,
) -> Iterator[_DriveJob]:
    for config in configs:
        for control in CONTROL_NAMES:
            if control not in controls or (control == "human only" and config is not configs[-1]):
                continue
            policy = "" if control == "human only" else _name(config)
            for repeat in range(1 if control == "alone" else repeats):
                folder = record if control == "keys" and repeat == 0 else None
                for scene in scenes:
                    yield _DriveJob(config, policy, control, repeat, scene, effects.get(policy), folder)


def _run_jobs(
    pool: WorkerPool[_Car],
    jobs: Sequence[_DriveJob],
    sent: Mapping[str, DriveConfig],
    kept: DrivingScoreJournal,
    progress: StepProgress | None,
) -> dict[str, DrivingScore]:
    scores = {job.key: score for job in jobs if (score := kept.find(job.key)) is not None}
    left = [job for job in jobs if job.key not in scores]
    work = [replace(job, config=sent[_name(job.config)]) for job in left]
    for number, score in pool.as_completed(_run_drive, work):
        scores[left[number].key] = score
        kept.keep(left[number].key, score)
        if progress is not None:
            progress(len(scores), len(jobs))
    return scores


def _summarize(
    jobs: Sequence[_DriveJob], scores: Mapping[str, DrivingScore], repeats: int
) -> Iterator[DrivingRow]:
    for policy, control in dict.fromkeys((job.policy, job.control) for job in jobs):
        mine = [job for job in jobs if (job.policy, job.control) == (policy, control)]
        groups = [[scores[job.key] for job in mine if job.repeat == repeat] for repeat in range(repeats)]
        driver = "" if control == "alone" else "program"
        yield summarize_row(policy, control, driver, [group for group in groups if group])


def _measure_keys(car: _Car, config: DriveConfig) -> KeyEffects:
    return measure_key_effects(car.loop(config, STRAIGHT, seed) for seed in MEASURING_SEEDS)


def _run_drive(car: _Car, job: _DriveJob) -> DrivingScore:
    loop = car.loop(job.config, job.scene)
    judgment = sample_judgment_errors(job.repeat, TEST_STARTS.index(job.scene))
    operator = make_operator(job.control, loop, job.effects, judgment)
    if job.folder is None:
        return drive_episode(loop, operator)
    path = job.folder / f"{robot_file_stem(job.policy)}-{job.scene}.rrd"
    return record_episode(loop, operator, path, job.config.activations)


def _name(config: DriveConfig) -> str:
    """Return the name of a policy in the table: that of its map."""
    return Path(config.stimulation_map.source).stem
