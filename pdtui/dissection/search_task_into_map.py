"""What `pdtui pursue` runs: search for a task's stimulation, then write the behavior into a map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.text import Text

from pdtui.core.atomic_file import check_writable, write_file
from pdtui.core.errors import MapError
from pdtui.core.units import Stimulation, parse_unit
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots.task import mean_figures
from pdtui.search.plan_search import TimeBudget
from pdtui.search.task_rollout import TimedStimulation
from pdtui.search.task_search import TaskSearch, TaskSearchResult, TaskSearchSettings
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.map_writer import add_behavior, compose_map, rewrite_map
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap


@dataclass(frozen=True)
class WrittenBehavior:
    """What was found and where it was written."""

    result: TaskSearchResult
    units: dict[str, float]
    seconds: float | None
    output: Path

    def as_dict(self) -> dict[str, Any]:
        """The form that ``--json`` prints."""
        held = self.result.verdicts
        return {
            "task": self.result.task.name,
            "magnitudes": self.units,
            "period": self.seconds,
            "held_out": {
                "walks": len(held),
                "done": sum(verdict.success for verdict in held),
                "by_itself": sum(verdict.success for verdict in self.result.untouched),
                "figures": mean_figures(held),
            },
            "rollouts": self.result.rollouts,
            "map": str(self.output),
        }

    def text(self) -> RenderableType:
        """What the command prints."""
        told = self.as_dict()
        held = told["held_out"]
        lasts = "" if self.seconds is None else f" for {self.seconds:g} s"
        figures = ", ".join(f"{name} {value:.2f}" for name, value in held["figures"].items())
        return Text(
            f"{told['task']}: {len(self.units)} units{lasts}; done on {held['done']} of {held['walks']} "
            f"walks that the search did not see, by itself on {held['by_itself']}; {figures}\n"
            f"wrote {self.output} ({told['rollouts']} roll-outs)"
        )


def search_task_into_map(
    robot: str,
    task: str,
    policy: str,
    output: Path,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    seed: int,
    workers: int,
    minutes: float,
    settings: TaskSearchSettings,
    progress: Callable[[int, int], None] | None = None,
) -> WrittenBehavior:
    """Search, and write the behavior into a map: a new file, or one of this policy.

    A behavior of the task that the map has already is where the search begins, too, and is replaced.

    Raises:
        MapError: no such task, or the map is of another policy or cannot be written.
        PdtuiError: the robot or the policy cannot be had.
    """
    known = load_map(output) if output.exists() else None
    check_writable(output, MapError)
    with RolloutPool(robot, policy, workers, import_options) as pool:
        goal, layers, dt = pool.robot.find_task(task), pool.policy.layers, pool.robot.control_dt
        if known is not None:
            known.check(robot, layers, pool.policy.sha256)
        begin = [] if known is None else _known_plans(known, task, pool)
        search = TaskSearch(pool, goal, seed, settings, begin)
        result = search.run(TimeBudget(minutes).share(), progress)
        new_map = StimulationMap(
            robot, pool.policy.name, pool.policy.sha256, "space", {}, {}, import_options=import_options
        )
    units = result.plan.stimulation.by_address(layers)
    seconds = None if result.plan.steps is None else round(result.plan.steps * dt, 6)
    behavior = Behavior(goal.name, goal.key, goal.says, units, period=seconds, task=goal.name)
    if known is None:
        text = add_behavior(compose_map(new_map), behavior, str(output))
        write_file(output, text, MapError)
    else:
        rewrite_map(output, lambda text: add_behavior(text, behavior, str(output)))
    return WrittenBehavior(result, units, seconds, output)


def _known_plans(stimulation_map: StimulationMap, task: str, pool: RolloutPool) -> list[TimedStimulation]:
    """The map's own behavior for the task."""
    found = []
    for behavior in stimulation_map.behaviors.values():
        if behavior.task == task and behavior.mode == "fixed":
            addressed = stimulation_map.units_of(behavior).items()
            values = {parse_unit(address, pool.policy.layers): value for address, value in addressed}
            steps = None if behavior.period is None else round(behavior.period / pool.robot.control_dt)
            found.append(TimedStimulation(Stimulation.of(values), steps))
    return found
