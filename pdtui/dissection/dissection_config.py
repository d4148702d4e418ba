"""What to dissect, and how: the one object behind `pdtui dissect` and `pdtui.dissect`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path

from torch import nn

from pdtui.dissection.dissection_settings import DissectionSettings
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.robots.robot import Robot
from pdtui.stimulation.stimulation_map import StimulationMap

StageProgress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class DissectionConfig:
    """A robot, a policy, and the way in which the policy is dissected.

    Without a time budget, the result depends on neither the machine's speed nor the number of workers.

    Attributes:
        robot: The robot's name, or a robot.
        policy: A weights file, the name of a shipped policy, a network in memory, or a policy.
        import_options: Answers to what the weights file does not state.
        preset: Preset of the matching, ``paper`` or ``authors``.
        preset_changes: Changes to the preset, each as ``NAME=VALUE``; see `pdtui.spectra.matching_presets`.
        settings: How much work is done.
        episodes: Monitored episodes; the paper has 5.
        seed: Seed of every random choice. Monitored episodes are reset with the seeds from here on, and walks
            to the starts of roll-outs with those from ``seed + 100`` on.
        start_from: A map, or its name or file, whose fixed behaviors the searches also begin from.
        budget_minutes: Time after which the searches end with the best found so far. Every unit is screened
            even if that takes longer.
        workers: Processes that run roll-outs. A robot or a policy given as an object stays in this process.
        journal: File that keeps every roll-out, so that an interrupted dissection continues where it stopped.
            It is left in place: delete it when the results are saved.
        progress: Called with the stage, the units of work done, and their total.
    """

    robot: str | Robot
    policy: str | Path | nn.Module | Policy
    _: KW_ONLY
    import_options: ImportOptions = NO_OPTIONS
    preset: str = "paper"
    preset_changes: Sequence[str] = ()
    settings: DissectionSettings = field(default_factory=DissectionSettings)
    episodes: int = 5
    seed: int = 1000
    start_from: str | Path | StimulationMap | None = None
    budget_minutes: float | None = None
    workers: int = 2
    journal: Path | None = None
    progress: StageProgress | None = None
