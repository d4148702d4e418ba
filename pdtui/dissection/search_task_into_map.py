"""What `pdtui pursue` runs: search for a task's stimulation, then write the behavior into a map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit
from rich.console import RenderableType
from rich.text import Text

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import MapError
from pdtui.core.units import Stimulation, parse_unit
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots.task import mean_figures
from pdtui.search.plan_search import TimeBudget
from pdtui.search.task_rollout import TimedStimulation
from pdtui.search.task_search import TaskSearch, TaskSearchResult, TaskSearchSettings
from pdtui.stimulation.map_reader import load_map
from pdtui.stimulation.map_toml import outputs_table
from pdtui.stimulation.map_writer import add_behavior, rewrite_map
from pdtui.stimulation.stimulation_map import StimulationMap


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
    with RolloutPool(robot, policy, workers, import_options) as pool:
        wanted = pool.robot.find_task(task)
        if known is not None:
            known.check(robot, pool.policy.layers, pool.policy.sha256)
        begin = [] if known is None else _known(known, task, pool)
        search = TaskSearch(pool, wanted, seed, settings, begin)
        result = search.run(TimeBudget(minutes).share(), progress)
        dt, addressed = pool.robot.control_dt, result.plan.stimulation.by_address(pool.policy.layers)
        if known is None:
            _new_map(output, robot, pool.policy.name, pool.policy.sha256, import_options)
    seconds = None if result.plan.steps is None else round(result.plan.steps * dt, 6)
    entry: dict[str, Any] = {"name": wanted.name, "key": wanted.key, "says": wanted.says}
    if seconds is not None:
        entry["period"] = seconds
    entry |= {"task": wanted.name, "magnitudes": outputs_table(addressed)}
    rewrite_map(output, lambda text: add_behavior(text, entry, str(output)))
    return WrittenBehavior(result, addressed, seconds, output)


def _known(stimulation_map: StimulationMap, task: str, pool: RolloutPool) -> list[TimedStimulation]:
    """The map's own behavior for the task."""
    found = []
    for behavior in stimulation_map.behaviors.values():
        if behavior.task == task and behavior.mode == "fixed":
            addressed = stimulation_map.units_of(behavior).items()
            values = {parse_unit(address, pool.policy.layers): value for address, value in addressed}
            steps = None if behavior.period is None else round(behavior.period / pool.robot.control_dt)
            found.append(TimedStimulation(Stimulation.of(values), steps))
    return found


def _new_map(path: Path, robot: str, policy: str, sha256: str, import_options: ImportOptions) -> None:
    document = tomlkit.document()
    document["schema"], document["robot"] = 1, robot
    given = {name: value for name, value in vars(import_options).items() if value}
    document["policy"] = {"name": policy, "sha256": sha256, **given}
    write_file(path, tomlkit.dumps(document), MapError)
