"""Search for a stimulation that does a task and write it into a map, as `pdtui pursue` does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.text import Text

from pdtui.core.atomic_file import check_writable, write_file
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.errors import MapError
from pdtui.core.units import Stimulation, parse_unit
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots import RobotSpec
from pdtui.robots.options.robot_option import format_robot_options
from pdtui.robots.task import average_figures
from pdtui.search.evolutionary_search import SharedTimeBudget
from pdtui.search.task_rollout import StimulationWithDuration
from pdtui.search.task_search import TaskSearch, TaskSearchResult
from pdtui.search.task_search_settings import TaskSearchSettings
from pdtui.search.verdict_journal import open_verdict_journal
from pdtui.stimulation.interventions.intervention import Onset
from pdtui.stimulation.key_allocator import KeyAllocator
from pdtui.stimulation.map_policy_lookup import relative_policy_name
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.map_robot_options import map_robot
from pdtui.stimulation.map_writer import add_behavior, add_seeds, compose_map, rewrite_map
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap


@dataclass(frozen=True)
class WrittenBehavior:
    """A behavior that was found for a task, and the map that it was written into.

    Attributes:
        units: Outputs by unit address.
        seconds: Activation period, s; None lasts until another key is pressed.
        onset: The moment of the gait at which it begins; None begins at once.
    """

    result: TaskSearchResult
    units: dict[str, float]
    seconds: float | None
    output: Path
    onset: Onset | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the form that ``--json`` prints."""
        verdicts = self.result.verdicts
        return {
            "task": self.result.task.name,
            "magnitudes": self.units,
            "period": self.seconds,
            "onset": None if self.onset is None else asdict(self.onset),
            "held_out": {
                "walks": len(verdicts),
                "done": self.result.done,
                "by_itself": self.result.done_without,
                "figures": average_figures(verdicts),
            },
            "rollouts": self.result.rollouts,
            "map": str(self.output),
        }

    def text(self) -> RenderableType:
        """Return what the command prints."""
        summary = self.as_dict()
        held_out = summary["held_out"]
        lasts = "" if self.seconds is None else f" for {self.seconds:g} s"
        if self.onset is not None:
            mark = self.onset.mark
            lasts += f", from {self.onset.delay:g} s after {mark.signal} rises above {mark.level:g}"
        figures = ", ".join(f"{name} {value:.2f}" for name, value in held_out["figures"].items())
        return Text(
            f"{summary['task']}: {len(self.units)} units{lasts}. Done on {held_out['done']} of "
            f"{held_out['walks']} held-out walks (without stimulation: {held_out['by_itself']}); {figures}.\n"
            f"wrote {self.output} ({summary['rollouts']} roll-outs)"
        )


def search_task_into_map(
    robot: RobotSpec,
    task: str,
    policy: str,
    output: Path,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    seed: int,
    workers: Workers,
    minutes: float,
    settings: TaskSearchSettings,
    journal: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> WrittenBehavior:
    """Search for a stimulation that does a task, and write it into a new map or one of the same policy.

    The robot has the map's options, if there is a map.
    If the map has a behavior for the task, the search also begins from it, and it is replaced.
    After `minutes` it ends with the best found so far. The `journal` is a file that keeps every roll-out, so
    that the same call goes on where an interrupted one stopped; None keeps nothing.

    Raises:
        MapError: There is no such task, or the map is of another policy or other options of the robot, or
            cannot be written.
        PdtuiError: The robot or the policy cannot be loaded.
    """
    known = load_map(output) if output.exists() else None
    check_writable(output, MapError)
    if known is not None:
        robot = _robot_of_map(known, robot)
    with RolloutPool(robot, policy, workers, import_options) as pool:
        goal, layers, dt = pool.robot.find_task(task), pool.policy.layers, pool.robot.control_dt
        if known is not None:
            known.check(robot.name, layers, pool.policy.sha256)
        begin = [] if known is None else _known_plans(known, task, pool)
        kept = (
            None
            if journal is None
            else open_verdict_journal(journal, pool.robot, pool.policy, import_options)
        )
        search = TaskSearch(pool, goal, seed, settings, begin, journal=kept)
        result = search.run(SharedTimeBudget(minutes).share(), progress)
        named, named_options = relative_policy_name(policy, import_options, output)
        new_map = StimulationMap(
            robot.name,
            named,
            pool.policy.sha256,
            "space",
            {},
            {},
            import_options=named_options,
            robot_options=dict(pool.robot.build_options),
        )
    behavior = draft_task_behavior(result, layers, dt)
    if known is not None:
        behavior = _fit_into_map(behavior, known)

    def change(text: str) -> str:
        return add_seeds(add_behavior(text, behavior, str(output)), result.seeds, str(output))

    if known is None:
        write_file(output, change(compose_map(new_map)), MapError)
    else:
        rewrite_map(output, change)
    return WrittenBehavior(result, dict(behavior.magnitudes), behavior.period, output, behavior.onset)


def draft_task_behavior(result: TaskSearchResult, layers: tuple[int, ...], dt: float) -> Behavior:
    """Return the behavior that does a task, for control steps of `dt` s."""
    task, steps = result.task, result.plan.steps
    period = None if steps is None else round(steps * dt, 6)
    units = result.plan.stimulation.by_address(layers)
    return Behavior(
        task.name, task.key, task.says, units, period=period, task=task.name, onset=result.plan.onset
    )


def _fit_into_map(behavior: Behavior, known: StimulationMap) -> Behavior:
    """Return the behavior with the name and key of the one that it replaces, or with a key that is free."""
    others = known.behaviors.values()
    for other in others:
        if other.task == behavior.task and other.mode == "fixed":
            return replace(behavior, name=other.name, key=other.key)
    keys = {other.key for other in others}
    if behavior.key in keys:
        pair = KeyAllocator(keys).take_key_pair(behavior.name)
        if pair is not None:
            return replace(behavior, key=pair[1])
    return behavior


def _robot_of_map(known: StimulationMap, robot: RobotSpec) -> RobotSpec:
    """Return the robot with the options of the map that gets the behavior."""
    found = map_robot(known, robot.name)
    if {**found.options, **robot.options} != found.options:
        own, typed = (format_robot_options(one.options) or "none" for one in (found, robot))
        raise MapError(
            f"{known.source}: expected the map's robot options ({own}), found {typed}; "
            "-o writes into another map"
        )
    return found


def _known_plans(
    stimulation_map: StimulationMap, task: str, pool: RolloutPool
) -> list[StimulationWithDuration]:
    """Return the plans of the map's behaviors for the task."""
    plans = []
    for behavior in stimulation_map.behaviors.values():
        if behavior.task == task and behavior.mode == "fixed":
            addressed = stimulation_map.units_of(behavior).items()
            values = {parse_unit(address, pool.policy.layers): value for address, value in addressed}
            steps = None if behavior.period is None else round(behavior.period / pool.robot.control_dt)
            plans.append(StimulationWithDuration(Stimulation.of(values), steps, behavior.onset))
    return plans
