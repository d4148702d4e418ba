"""How far a robot gets through a forest alone, with an operator, with a placebo, and with vision.

The paper's task transfer (section 4): a policy that senses only its own body is driven through trees that it
cannot sense. All conditions run in the same forests for the same time. The placebo presses the operator's
keys without looking, which shows what pressing them does by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.errors import PdtuiError, PolicyError, SessionError
from pdtui.core.processes.worker_pool import StepProgress, WorkerPool
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop, send_drive_files
from pdtui.paper.forest.forest_episode import (
    FOREST,
    ROUGH,
    ForestEpisodeScore,
    drive_forest_episode,
    drive_with_random_keys,
    read_forest_episode,
    record_forest_episode,
)
from pdtui.paper.forest.forest_results import (
    ForestCondition,
    ForestExperimentResult,
    compare_conditions,
    summarize_condition,
)
from pdtui.paper.forest.key_motion_fit import fit_key_motion_models
from pdtui.paper.forest.key_motion_model import KeyMotionModel, ObservedDrive
from pdtui.paper.forest.key_pressers import KeyPresser, OperatorPresser, PlaceboPresser
from pdtui.paper.forest.scripted_operator import operator_keys
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.robots import require_robot_name, robot_file_stem
from pdtui.stimulation.stimulation_map import StimulationMap

CONDITIONS: dict[ForestCondition, str] = {
    "alone": "state alone",
    "operator": "state with an operator",
    "placebo": "state with a placebo",
    "vision": "state + vision",
}
PERSON = "state with a person"
STEPS, REPEATS = 2400, 5
"""Control steps per episode, of which the A1 needs about 1300 on a straight way; repeats."""
TRIED_SEEDS, TRIED_STEPS = tuple(range(900, 908)), 900
"""Seeds and length of the drives on rough ground to which the operator's key models are fitted."""


def evaluate_forest(
    config: DriveConfig,
    seeds: Sequence[int],
    *,
    conditions: Sequence[ForestCondition] = tuple(CONDITIONS),
    sessions: Sequence[Path] = (),
    repeats: int = REPEATS,
    steps: int = STEPS,
    record: Path | None = None,
    tried: tuple[Sequence[int], int] = (TRIED_SEEDS, TRIED_STEPS),
    workers: Workers = 2,
    progress: StepProgress | None = None,
) -> ForestExperimentResult:
    """Measure the conditions in the same forests, and score recorded drives.

    An episode ends at a fall or at the far end of the forest; what it gained up to then counts.

    Args:
        config: robot, map and policy; its seed and start are not used.
        seeds: seeds of the forests; consecutive seeds form a repeat.
        conditions: conditions to measure; a placebo needs the operator's drives, so the operator is measured,
            too. Vision is left out if its robot or policy does not exist.
        sessions: a person's drives, each a repeat of one episode.
        record: folder for the operator's drives, each a session and a keystroke file.
        tried: seeds and control steps of the drives to which the key models are fitted.

    Raises:
        PdtuiError: the robot, policy or map cannot be loaded or lacks what is needed, the seeds cannot be
            divided, or a session cannot be scored.
    """
    if conditions and (not seeds or len(seeds) % repeats):
        raise PdtuiError(f"{len(seeds)} seeds cannot be divided into {repeats} equal repeats")
    wanted = {*conditions, *(["operator"] if "placebo" in conditions else [])}
    conditions = [one for one in CONDITIONS if one in wanted]
    config = replace(config, seed=0, start=FOREST)
    loop = build_control_loop(config)
    name, dt, policy = config.robot, loop.robot.control_dt, loop.policy.name
    person_drives = [(path, *read_forest_episode(path, name, steps)) for path in sessions]
    configs, left_out = _configs(config, conditions)
    fit_seeds = tuple(tried[0]) if "operator" in configs else ()
    keys = list(operator_keys(config.stimulation_map)) if fit_seeds else []
    if taken := sorted(set(fit_seeds) & set(seeds)):
        raise PdtuiError(f"seed {taken[0]}: the operator's key models are fitted on that seed")
    if record is not None and (present := sorted(record.glob("*.rrd"))):
        raise SessionError(f"{present[0]}: already exists; drives are recorded into a new folder")
    total, done = len(fit_seeds) + len(configs) * len(seeds), 0
    key_models: dict[str, KeyMotionModel] = {}
    runs: dict[ForestCondition, list[ForestEpisodeScore]] = {}

    def tell(here: int, _: int) -> None:
        if progress is not None:
            progress(done + here, total)

    sent = {one: send_drive_files(workers, its_config) for one, its_config in configs.items()}
    observed = replace(send_drive_files(workers, config), start=ROUGH)
    with WorkerPool(f"forests of {name}", workers, _LoopCache(), _LoopCache) as pool:
        drives = pool.map(_observe_keys, [(observed, seed, tried[1]) for seed in fit_seeds], tell)
        done += len(drives)
        if drives:
            key_models = fit_key_motion_models(drives, keys, dt)
        for condition, its_config in sent.items():
            jobs = [_EpisodeJob(its_config, seed, steps) for seed in seeds]
            if condition == "operator":
                jobs = [replace(job, key_models=key_models, folder=record) for job in jobs]
            elif condition == "placebo":
                operated = zip(jobs, runs["operator"], strict=True)
                jobs = [replace(job, placebo_of=run) for job, run in operated]
            runs[condition] = pool.map(_run_episode, jobs, tell)
            done += len(jobs)
    measured = [
        summarize_condition(CONDITIONS[one], configs[one].policy or policy, runs[one], repeats)
        for one in runs
    ]
    if person_drives:
        driven = ", ".join(sorted({session_policy for _, _, session_policy in person_drives}))
        measured.append(
            summarize_condition(PERSON, driven, [run for _, run, _ in person_drives], len(person_drives))
        )
    return ForestExperimentResult(
        name,
        tuple(seeds) if conditions else (),
        repeats,
        steps,
        steps * dt,
        tuple(measured),
        compare_conditions(runs, CONDITIONS),
        left_out,
        key_models,
        fit_seeds,
        tuple(map(str, sessions)),
    )


@dataclass(frozen=True)
class _EpisodeJob:
    """One episode to run.

    Attributes:
        key_models: what the operator knows of its keys; None for no operator.
        folder: folder for the operator's drive; None to record none.
        placebo_of: the operator's run whose keys a placebo presses; None for no placebo.
    """

    config: DriveConfig
    seed: int
    steps: int
    key_models: dict[str, KeyMotionModel] | None = None
    folder: Path | None = None
    placebo_of: ForestEpisodeScore | None = None


class _LoopCache:
    """The loop built last: building one takes longer than many episodes, and conditions run one by one."""

    _built: tuple[DriveConfig, ControlLoop] | None = None

    def loop(self, config: DriveConfig, seed: int) -> ControlLoop:
        common = replace(config, start="")
        if self._built is None or self._built[0] != common:
            self._built = common, build_control_loop(common)
        built = self._built[1]
        return ControlLoop(built.robot, built.policy, built.map, seed, start=config.start)


def _observe_keys(loops: _LoopCache, job: tuple[DriveConfig, int, int]) -> ObservedDrive:
    config, seed, steps = job
    return drive_with_random_keys(loops.loop(config, seed), steps)


def _run_episode(loops: _LoopCache, job: _EpisodeJob) -> ForestEpisodeScore:
    loop = loops.loop(job.config, job.seed)
    presser: KeyPresser | None = None
    if job.key_models is not None:
        presser = OperatorPresser(loop, job.key_models)
    elif job.placebo_of is not None:
        presser = PlaceboPresser(job.placebo_of.keys, job.placebo_of.steps, job.seed)
    if presser is None or job.folder is None:
        return drive_forest_episode(loop, job.steps, presser)[0]
    path = job.folder / f"{robot_file_stem(job.config.robot)}-forest-seed{job.seed}.rrd"
    return record_forest_episode(loop, job.steps, presser, path, job.config.activations)


def _configs(
    config: DriveConfig, conditions: Sequence[ForestCondition]
) -> tuple[dict[ForestCondition, DriveConfig], dict[str, str]]:
    """Return the drive of each condition, and why some are left out."""
    configs: dict[ForestCondition, DriveConfig] = {}
    left_out = {}
    for condition in conditions:
        try:
            configs[condition] = _with_vision(config) if condition == "vision" else config
        except PdtuiError as error:
            left_out[CONDITIONS[condition]] = str(error)
    return configs, left_out


def _with_vision(config: DriveConfig) -> DriveConfig:
    """Return the drive of the robot with vision, with its shipped policy and without behaviors."""
    name = require_robot_name(f"{config.robot}-vision")
    try:
        find_weights_file(name)
    except PolicyError as error:
        raise PolicyError(f"'{name}' has no policy yet: {error}") from error
    judged = config.stimulation_map
    nothing = StimulationMap(name, name, "", judged.default_key, {}, {}, robot_options=judged.robot_options)
    return DriveConfig(name, nothing, 0, name, start=FOREST, force=True)
