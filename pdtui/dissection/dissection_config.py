"""What to dissect, and with how much work: the one object behind `pdtui dissect` and `pdtui.dissect`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from torch import nn

from pdtui.core.cluster.ray_cluster import Workers
from pdtui.dissection.steering.steering_comparison import SteeringSettings
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.robots import RobotSpec
from pdtui.robots.robot import Robot
from pdtui.search.behavior_search import BehaviorSearchSettings
from pdtui.search.controller_search import ControllerSearchSettings
from pdtui.search.imprint_candidates import ImprintSettings
from pdtui.search.task_search_settings import TaskSearchSettings
from pdtui.stimulation.seed_ranges import FIRST_SEARCH_SEED, require_search_seeds
from pdtui.stimulation.stimulation_map import StimulationMap

StageProgress = Callable[[str, int, int], None]

SEEDS_PER_DISSECTION = 2000
"""Number of seeds from a dissection's first on that it uses, besides those of searches for tasks."""


Part = TypeVar("Part", "DissectionSettings", BehaviorSearchSettings, ControllerSearchSettings)


@dataclass(frozen=True)
class DissectionSettings:
    """How much work a dissection does. The defaults take 10 to 15 minutes on two idle cores.

    Attributes:
        steps: Control steps of a monitored episode.
        screen_values, screen_starts, screen_steps: Outputs at which every unit is screened, the number of
            starts, and the control steps of each roll-out.
        refine_keep: Units kept after screening, for each attribute and direction.
        refine_values, refine_starts, refine_steps: The same as for screening, for the units kept; their
            starts are others. They choose the units, and their outputs, that are judged.
        judge_keep: Units judged for each attribute, besides its first match.
        controls: Units drawn at random and held in the same way as those that are judged.
        judge_starts, held_steps: Starts that judge, which chose nothing, and control steps of the long
            roll-outs that tell a lasting change of a rate from a passing one.
        level: Share of the confirmed pairs of a unit and an attribute that may be false.
        mover_singles, mover_pairs: Units tried alone, and second units tried beside the best of them, for
            each attribute and direction.
        mover_steps: Control steps of those roll-outs, and of those that compare ways to steer.
        steering: Settings of the comparison of ways to steer.
        search_starts, selection_starts, held_out_starts: Starts of the searches: those they optimize on,
            choose among the finalists on, and are judged on.
        walk_steps: Most control steps between a reset and a start; half of them are the least.
        imprints: Settings of the imprints that the searches begin from.
        behavior_search, controller_search, task_search: Settings of the searches.
    """

    steps: int = 1000
    screen_values: tuple[float, ...] = (-4.0, -2.0, 2.0, 4.0)
    screen_starts: int = 2
    screen_steps: int = 60
    refine_keep: int = 2
    refine_values: tuple[float, ...] = (-8.0, -4.0, -2.0, 0.0, 2.0, 4.0, 8.0)
    refine_starts: int = 6
    refine_steps: int = 80
    judge_keep: int = 2
    controls: int = 199
    judge_starts: int = 12
    held_steps: int = 1000
    level: float = 0.05
    mover_singles: int = 3
    mover_pairs: int = 4
    mover_steps: int = 240
    steering: SteeringSettings = field(default_factory=SteeringSettings)
    search_starts: int = 10
    selection_starts: int = 12
    held_out_starts: int = 16
    walk_steps: int = 100
    imprints: ImprintSettings = field(default_factory=ImprintSettings)
    behavior_search: BehaviorSearchSettings = field(default_factory=BehaviorSearchSettings)
    controller_search: ControllerSearchSettings = field(default_factory=ControllerSearchSettings)
    task_search: TaskSearchSettings = field(default_factory=partial(TaskSearchSettings, restarts=2))

    @property
    def longest_rollout(self) -> int:
        """Control steps of the longest roll-out, except the long ones of `held_steps`."""
        behaviors, controllers = self.behavior_search, self.controller_search
        return max(
            *(self.screen_steps, self.refine_steps, self.mover_steps),
            *(behaviors.quick_steps, behaviors.full_steps, behaviors.final_steps),
            *(controllers.steps, controllers.final_steps),
        )

    def shortened_to(self, steps: int) -> DissectionSettings:
        """Return settings whose walks, start and roll-out together, last at most this many control steps.

        A quarter of them at most is spent on reaching the start. The long roll-outs of `held_steps` stay as
        they are.
        """
        walk = min(self.walk_steps, steps // 4)
        longest = max(1, steps - walk)

        def shorten(part: Part, *fields: str) -> Part:
            return replace(part, **{name: min(getattr(part, name), longest) for name in fields})

        shorter = shorten(self, "screen_steps", "refine_steps", "mover_steps")
        return replace(
            shorter,
            walk_steps=walk,
            behavior_search=shorten(self.behavior_search, "quick_steps", "full_steps", "final_steps"),
            controller_search=shorten(self.controller_search, "steps", "final_steps"),
        )


QUICK_DISSECTION = DissectionSettings(
    steps=400, screen_values=(-3.0, 3.0), screen_steps=40, refine_keep=1,
    refine_values=(-3.0, 0.0, 3.0), refine_starts=4, refine_steps=60,
    judge_keep=1, controls=99, judge_starts=8,
    mover_singles=2, mover_pairs=0, mover_steps=160,
    steering=SteeringSettings(
        starts=2, sources=2, values=(2.0, 4.0), lengths=(0.5, 1.0), readings=(1.0, 2.0), factors=(1.0, 2.0),
    ),
    search_starts=3, selection_starts=4, held_out_starts=8, walk_steps=50,
    imprints=ImprintSettings(episodes=4, steps=40, bins=3, units=(8,), factors=(1.0,)),
    behavior_search=BehaviorSearchSettings(
        random_sets=12, single_units=6, elite=4, children=6, promoted=2, max_units=(3,), generations=2,
        quick_starts=1, quick_steps=60, full_starts=3, full_steps=120, finalists=2, final_steps=160,
    ),
    controller_search=ControllerSearchSettings(units=1, pairs=1, finalists=2, steps=60, final_steps=160),
    task_search=TaskSearchSettings(
        values=(-4.0, 4.0), elite=4, children=8, promoted=4, quick_seeds=1, full_seeds=3, max_units=(3,),
        generations=3, finalists=2, selection_seeds=6, restarts=0,
    ),
)  # fmt: skip
"""A first look that takes about a minute: fewer outputs per unit, fewer starts, and hardly any search."""


@dataclass(frozen=True)
class DissectionConfig:
    """A robot, a policy, and the way in which the policy is dissected.

    Without a time budget, the result depends on neither the machine's speed nor the number of workers.

    Attributes:
        robot: The robot's name, its name with options, or a robot.
        policy: A weights file, the name of a shipped policy, a network in memory, or a policy.
        import_options: Answers to what the weights file does not state.
        preset: Preset of the matching, ``paper`` or ``authors``.
        preset_changes: Changes to the preset, each as ``NAME=VALUE``; see `pdtui.spectra.matching_presets`.
        settings: How much work is done.
        episodes: Monitored episodes; the paper has 5.
        seed: Seed of every random choice, none of those for judging. Monitored episodes are reset with the
            seeds from here on, walks to the starts of roll-outs with those from ``seed + 100`` on, and
            nothing with those from ``seed + SEEDS_PER_DISSECTION`` on.
        start_from: A map, or its name or file, whose fixed behaviors the searches also begin from.
        budget_minutes: Time after which the searches end with the best found so far. Every unit is screened
            even if that takes longer.
        workers: Number of processes that run roll-outs, or a cluster. A robot or a policy given as an object
            stays in this process.
        journal: File that keeps every roll-out, so that an interrupted dissection continues where it stopped.
            It is left in place: delete it when the results are saved.
        progress: Called with the stage, the units of work done, and their total; or True for a bar on
            standard error, for `pdtui.dissect` only.

    Raises:
        SeedError: The seed is reserved for judging.
    """

    robot: str | RobotSpec | Robot
    policy: str | Path | nn.Module | Policy
    _: KW_ONLY
    import_options: ImportOptions = NO_OPTIONS
    preset: str = "paper"
    preset_changes: Sequence[str] = ()
    settings: DissectionSettings = field(default_factory=DissectionSettings)
    episodes: int = 5
    seed: int = FIRST_SEARCH_SEED
    start_from: str | Path | StimulationMap | None = None
    budget_minutes: float | None = None
    workers: Workers = 2
    journal: Path | None = None
    progress: StageProgress | bool | None = None

    def __post_init__(self) -> None:
        require_search_seeds([self.seed], "a dissection")

    @property
    def report(self) -> StageProgress | None:
        """The function that is told of the progress, if any."""
        return self.progress if callable(self.progress) else None
