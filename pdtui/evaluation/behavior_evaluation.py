"""`pdtui evaluate`: what each behavior of a map does when it is held, beside what would do as well.

Each seed is driven with the policy alone and with each behavior, pressed at a step that the seed draws and
held; see `ProtocolSettings`. The same is done in disturbed worlds, and with substitutes for the behavior's
units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.outcome import count_failures
from pdtui.core.processes.worker_pool import StepProgress, WorkerPool
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop, send_drive_files
from pdtui.evaluation.behavior_summary import (
    BehaviorEvaluation,
    BehaviorRuns,
    SubstituteFigures,
    summarize_behavior,
    summarize_substitute,
)
from pdtui.evaluation.disturbance_conditions import UNDISTURBED
from pdtui.evaluation.effect_figures import relative_spread
from pdtui.evaluation.evaluation_plan import EvaluationPlan, RunKey
from pdtui.evaluation.held_run import (
    HeldRunPlan,
    HeldRunTrace,
    InterventionMeasurement,
    measure_intervention,
    run_held_behavior,
)
from pdtui.evaluation.journal.run_journal import RunJournal
from pdtui.evaluation.paired_statistics import holm_correction
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.evaluation.tasks.task_runs import (
    count_task_steps,
    list_task_runs,
    plan_task_episode,
    run_task_episode,
    task_measuring_runs,
)
from pdtui.evaluation.tasks.task_success import TaskEvaluation, summarize_tasks
from pdtui.stimulation.stimulation_map import Behavior, MeasuredEffect

FEWEST_DIFFERENT = 0.02
"""Spread of the starts, as a share of the mean, below which seeds are nearly one start."""


@dataclass(frozen=True)
class MapEvaluation:
    """What all behaviors of a map do.

    Attributes:
        robot, policy: Their names.
        seeds: The seeds.
        settings: The sizes of the evaluation.
        control_steps: Control steps that were planned; episodes that end early make them fewer.
        start_spread: Standard deviation over seeds of the mean speed (of the first attribute, where there is
            no speed) in the first window without a press, as a share of its mean; NaN for one seed.
        nearly_one_start: Whether that is less than 2 %, so that many seeds tell hardly more than one.
        not_offered: Conditions that the robot cannot be put in.
        behaviors: Every behavior with an aim, in each condition.
        tasks: Every behavior with a task, in each condition.
    """

    robot: str
    policy: str
    seeds: tuple[int, ...]
    settings: ProtocolSettings
    control_steps: int
    start_spread: float
    nearly_one_start: bool
    not_offered: tuple[str, ...]
    behaviors: tuple[BehaviorEvaluation, ...]
    tasks: tuple[TaskEvaluation, ...] = ()

    def undisturbed(self) -> list[BehaviorEvaluation]:
        """Return the rows of the robot's own world."""
        return [row for row in self.behaviors if row.condition == UNDISTURBED.name]

    def measured_effects(self) -> dict[str, MeasuredEffect]:
        """Return the undisturbed effects at the end of the hold by behavior, as maps hold them."""
        return {
            row.behavior: MeasuredEffect(
                row.last.effect, row.last.low, row.last.high, count_failures(row.outcomes), row.runs
            )
            for row in self.undisturbed()
        }


def plan_evaluation(
    config: DriveConfig, seeds: Sequence[int], settings: ProtocolSettings | None = None
) -> EvaluationPlan:
    """Return the runs of an evaluation; the seed of `config` is not used.

    Raises:
        PdtuiError: The robot, policy or map cannot be loaded.
    """
    return EvaluationPlan(build_control_loop(config), tuple(seeds), settings or ProtocolSettings())


def count_control_steps(plan: EvaluationPlan) -> int:
    """Return how many control steps an evaluation runs; episodes that end early make it fewer."""
    held = sum(plan.times(key.behavior, key.seed).steps for key in plan.held_runs())
    measuring = [*plan.measuring_runs(), *task_measuring_runs(plan)]
    first = sum(run.times.press + run.times.window for run in measuring)
    return held + first + sum(count_task_steps(plan, run) for run in list_task_runs(plan))


def evaluate_behaviors(
    config: DriveConfig,
    plan: EvaluationPlan,
    *,
    workers: Workers = 1,
    journal: Path | None = None,
    progress: StepProgress | None = None,
) -> MapEvaluation:
    """Run an evaluation; `progress` is called with the number of runs done and the total.

    Args:
        config: What the plan was made for; worker processes build it again.
        plan: The runs.
        workers: Number of worker processes, or a cluster.
        journal: File that keeps the result of every run, and from which finished runs are taken.
        progress: Called with the number of runs done and of all runs.

    Raises:
        PdtuiError: The journal cannot be read or written, or is of something else.
    """
    kept = RunJournal(journal, plan.loop)
    measuring, in_tasks = plan.measuring_runs(), task_measuring_runs(plan)
    held, tasks = plan.held_runs(), list_task_runs(plan)
    trials = [*measuring, *in_tasks]
    total, done = len(trials) + len(held) + len(tasks), 0

    def advance(finished: int, _jobs: int) -> None:
        if progress is not None:
            progress(done + finished, total)

    sent = send_drive_files(workers, config)
    with WorkerPool(f"evaluation of {config.robot}", workers, plan.loop, build_control_loop, sent) as pool:
        found = pool.map(measure_intervention, trials, advance, kept.of(measure_intervention))
        measured = _by_behavior(measuring, found[: len(measuring)])
        measured_in_tasks = measured | _by_behavior(in_tasks, found[len(measuring) :])
        done += len(trials)
        runs = {key: run for key in held if (run := plan.held_plan(key, measured)) is not None}
        found_traces = pool.map(run_held_behavior, list(runs.values()), advance, kept.of(run_held_behavior))
        traces = dict(zip(runs, found_traces, strict=True))
        done += len(held)
        planned = [plan_task_episode(plan, run, measured_in_tasks) for run in tasks]
        episodes = [one for one in planned if one is not None]
        judged = pool.map(run_task_episode, episodes, advance, kept.of(run_task_episode))
        verdicts = {one.run: verdict for one, verdict in zip(episodes, judged, strict=True)}
    return _summarize(plan, traces, summarize_tasks(plan, verdicts))


def _by_behavior(
    runs: Sequence[HeldRunPlan], found: Sequence[InterventionMeasurement]
) -> dict[str, list[InterventionMeasurement]]:
    measured: dict[str, list[InterventionMeasurement]] = {}
    for run, one in zip(runs, found, strict=True):
        measured.setdefault(run.behavior, []).append(one)
    return measured


def _summarize(
    plan: EvaluationPlan, traces: Mapping[RunKey, HeldRunTrace], tasks: tuple[TaskEvaluation, ...]
) -> MapEvaluation:
    robot = plan.loop.robot
    rows: list[BehaviorEvaluation] = []
    tables = [UNDISTURBED.name], [name for name in plan.conditions if name != UNDISTURBED.name]
    for table in tables:
        own = [_runs_of(plan, traces, behavior, name) for name in table for behavior in plan.behaviors]
        summaries = [
            replace(summarize_behavior(runs), substitutes=_summarize_substitutes(plan, traces, runs))
            for runs in own
        ]
        rows += correct_over_table(summaries, plan.settings.level)
    names = [attribute.name for attribute in robot.attributes]
    defaults = [traces[RunKey("", seed)] for seed in plan.seeds] if plan.behaviors else []
    times, column = plan.times("", plan.seeds[0]), names.index("speed") if "speed" in names else 0
    spread = relative_spread(defaults, column, times)
    return MapEvaluation(
        robot.name,
        plan.loop.policy.name,
        tuple(plan.seeds),
        plan.settings,
        count_control_steps(plan),
        spread,
        spread < FEWEST_DIFFERENT,
        plan.not_offered,
        tuple(rows),
        tasks,
    )


def _runs_of(
    plan: EvaluationPlan, traces: Mapping[RunKey, HeldRunTrace], behavior: Behavior, condition: str
) -> BehaviorRuns:
    seeds = plan.seeds_of(condition)
    return BehaviorRuns(
        behavior,
        condition,
        plan.loop.robot.attributes,
        [plan.times(behavior.name, seed) for seed in seeds],
        [traces[RunKey(behavior.name, seed, condition)] for seed in seeds],
        [traces[RunKey("", seed, condition)] for seed in seeds],
        plan.loop.robot.outcomes,
    )


def _summarize_substitutes(
    plan: EvaluationPlan, traces: Mapping[RunKey, HeldRunTrace], own: BehaviorRuns
) -> tuple[SubstituteFigures, ...]:
    if own.condition != UNDISTURBED.name:
        return ()
    seeds, name = plan.seeds[: plan.settings.draw_seeds], own.behavior.name
    figures = []
    for kind, draws in plan.substitutes_of(own.behavior):
        keys = [[RunKey(name, seed, UNDISTURBED.name, kind, draw) for seed in seeds] for draw in range(draws)]
        if keys[0][0] in traces:
            drawn = [[traces[key] for key in row] for row in keys]
            figures.append(summarize_substitute(kind, own, drawn))
    return tuple(figures)


def correct_over_table(rows: Sequence[BehaviorEvaluation], level: float) -> list[BehaviorEvaluation]:
    """Correct the p-values of each window over the rows of one table, and say which effects hold."""
    first = holm_correction([row.first.p_value for row in rows])
    last = holm_correction([row.last.p_value for row in rows])
    return [
        replace(
            row,
            first=replace(row.first, corrected=p_first),
            last=replace(row.last, corrected=p_last),
            holds=p_last < level and row.last.effect * row.wanted > 0.0,
        )
        for row, p_first, p_last in zip(rows, first, last, strict=True)
    ]
