"""`pdtui evaluate`: what each behavior of a map does, on seeds that no search used.

Each seed is driven twice from the same reset: with the policy alone, and with the behavior latched from step
`STIMULATED_FROM` on. Attributes are averaged over the last `WINDOW` control steps; an effect is the
difference between both drives of a seed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.confidence_intervals import confidence_interval
from pdtui.core.drive_events import DriveEvent
from pdtui.core.worker_pool import StepProgress, WorkerPool
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import run_episode
from pdtui.driving.loop_builder import build_control_loop
from pdtui.evaluation.task_evaluation import TaskEvaluation, TaskRunResult, run_task_episode, summarise_task
from pdtui.stimulation.stimulation_map import Behavior, MeasuredEffect

STEPS = 400
"""Control steps per episode."""
STIMULATED_FROM = 100
"""Control step before which the behavior is latched: the robot walks steadily by then."""
WINDOW = 200
"""Control steps at the end of an episode over which attributes are averaged."""


@dataclass(frozen=True)
class BehaviorEvaluation:
    """The effect of one behavior over all seeds.

    Attributes:
        measure: attribute, its unit and what the behavior aims at.
        effect: mean over seeds of the difference to the policy alone, in the attribute's unit.
        low, high: 95 % interval of `effect` (Student's t over seeds).
        value: mean of the attribute with the behavior.
        default: mean of the attribute with the policy alone.
        right_sign: number of seeds on which the robot stayed up and the behavior reached its aim: the
            difference has the right sign and, unless the aim is ``raise`` or ``lower``, so has the attribute
            itself; for ``stop``, the attribute is less than a fifth of the default.
        falls: number of seeds on which the robot fell with the behavior.
        default_falls: number of seeds on which it fell with the policy alone.
    """

    behavior: str
    measure: str
    effect: float
    low: float
    high: float
    value: float
    default: float
    right_sign: int
    falls: int
    default_falls: int


@dataclass(frozen=True)
class MapEvaluation:
    """The effects of all behaviors of a map, and the success of those with a task."""

    robot: str
    policy: str
    seeds: tuple[int, ...]
    behaviors: tuple[BehaviorEvaluation, ...]
    tasks: tuple[TaskEvaluation, ...] = ()

    def measured_effects(self) -> dict[str, MeasuredEffect]:
        """Return the effects by behavior, as maps hold them."""
        return {
            one.behavior: MeasuredEffect(one.effect, one.low, one.high, one.falls, len(self.seeds))
            for one in self.behaviors
        }


@dataclass(frozen=True)
class BehaviorRunMeans:
    """Means of attributes over the measured steps of one episode, shape (J,), and whether the robot fell."""

    mean: Floats
    fell: bool


def evaluate_behaviors(
    config: DriveConfig, seeds: Sequence[int], *, workers: int = 2, progress: StepProgress | None = None
) -> MapEvaluation:
    """Measure every behavior of the map that has an aim or a task.

    The seed of `config` is not used; `progress` is called with the number of runs done and the total.

    Raises:
        PdtuiError: the robot, policy or map cannot be loaded.
    """
    known = config.stimulation_map.behaviors.values()
    tasked = [b for b in known if b.task]
    behaviors = [b for b in known if b.aim is not None and b.pid is None]
    loop = build_control_loop(config)
    names = ["", *(b.name for b in behaviors)] if behaviors else []
    jobs: list[_Job] = [(name, seed, "aim") for name in names for seed in seeds]
    jobs += [(b.name, seed, kind) for b in tasked for kind in ("task", "untouched") for seed in seeds]
    with WorkerPool(f"evaluation of {config.robot}", workers, loop, build_control_loop, config) as pool:
        runs: dict[_Job, Any] = dict(zip(jobs, pool.map(_run_job, jobs, progress), strict=True))
    return MapEvaluation(
        config.robot,
        loop.policy.name,
        tuple(seeds),
        tuple(_summarise(loop, behavior, runs, seeds) for behavior in behaviors),
        tuple(
            summarise_task(
                behavior,
                loop.robot.find_task(behavior.task),
                [runs[behavior.name, seed, "task"] for seed in seeds],
                [runs[behavior.name, seed, "untouched"] for seed in seeds],
            )
            for behavior in tasked
        ),
    )


_Job = tuple[str, int, str]
"""A behavior's name, a seed, and what to run: ``aim``, ``task``, or ``untouched`` for a task without it."""


def _run_job(loop: ControlLoop, job: _Job) -> BehaviorRunMeans | TaskRunResult:
    name, seed, kind = job
    if kind == "aim":
        return run_behavior_episode(loop, name, seed)
    return run_task_episode(loop, loop.map.behaviors[name], seed, untouched=kind == "untouched")


def run_behavior_episode(built: ControlLoop, name: str, seed: int) -> BehaviorRunMeans:
    """Run one episode with a behavior, or with the policy alone where the name is empty.

    If the episode ends early, the mean is over the steps from `STIMULATED_FROM` to its end.
    """
    loop = ControlLoop(built.robot, built.policy, built.map, seed)

    def press(step: int) -> list[DriveEvent]:
        return [DriveEvent(step, "behavior", name)] if name and step == STIMULATED_FROM else []

    records = list(run_episode(loop, STEPS, press))
    rows = [record.attributes for record in records]
    ended = bool(records[-1].ended)
    window = rows[min(STIMULATED_FROM, len(rows) - 1) :] if ended else rows[-WINDOW:]
    return BehaviorRunMeans(np.mean(window, axis=0), records[-1].fell)


def _summarise(
    loop: ControlLoop, behavior: Behavior, runs: dict[_Job, Any], seeds: Sequence[int]
) -> BehaviorEvaluation:
    assert behavior.aim is not None
    column = loop.robot.attribute_index(behavior.aim.attribute)
    with_it = np.array([runs[behavior.name, seed, "aim"].mean[column] for seed in seeds])
    default = np.array([runs["", seed, "aim"].mean[column] for seed in seeds])
    fell = np.array([runs[behavior.name, seed, "aim"].fell for seed in seeds])
    effect = with_it - default
    sign = behavior.aim.sign
    if behavior.aim.direction == "stop":
        right = np.abs(with_it) < 0.2 * np.abs(default)
        wanted = "near 0"
    elif behavior.aim.direction in ("raise", "lower"):
        right = effect * sign > 0
        wanted = "more" if sign > 0 else "less"
    else:
        right = (with_it * sign > 0) & (effect * sign > 0)
        wanted = "> 0" if sign > 0 else "< 0"
    return BehaviorEvaluation(
        behavior.name,
        f"{behavior.aim.attribute} ({loop.robot.attributes[column].unit}), wanted {wanted}",
        float(effect.mean()),
        *confidence_interval(effect),
        float(with_it.mean()),
        float(default.mean()),
        int((right & ~fell).sum()),
        int(fell.sum()),
        int(sum(runs["", seed, "aim"].fell for seed in seeds)),
    )
