"""`pdtui evaluate --experiment commands`: how closely a policy follows the commands that it is given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pdtui.core.errors import RobotError
from pdtui.core.events import Event
from pdtui.core.intervals import confidence_interval
from pdtui.drive.control_loop import ControlLoop
from pdtui.drive.drive_config import DriveConfig
from pdtui.drive.headless_drive import run_episode
from pdtui.drive.loop_builder import build_loop
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

SETTLED = 100
_ASKED = "asked"


@dataclass(frozen=True)
class CommandTracking:
    """One command over all seeds.

    Attributes:
        command, unit: what was asked for.
        asked: of each seed.
        error, low, high: mean |attribute − command| over the steps, then over seeds, with its 95 % interval.
        bias: mean |mean of the attribute − command| over seeds: what is left where the gait is averaged out.
    """

    command: str
    unit: str
    asked: tuple[float, ...]
    error: float
    low: float
    high: float
    bias: float


@dataclass(frozen=True)
class CommandFollowingResult:
    """How closely commands are followed.

    Attributes:
        robot, policy: names.
        seeds: of the episodes; each draws its own commands.
        steps: control steps an episode; the first 100 are left out.
        commands: one by one.
        finished: episodes without a fall.
    """

    robot: str
    policy: str
    seeds: tuple[int, ...]
    steps: int
    commands: tuple[CommandTracking, ...]
    finished: int

    def as_dict(self) -> dict[str, Any]:
        """The form that ``--json`` prints."""
        return asdict(self)


def evaluate_command_following(
    config: DriveConfig, seeds: Sequence[int], *, progress: Callable[[int, int], None] | None = None
) -> CommandFollowingResult:
    """Ask for commands drawn from the ranges of training, one set a seed, for a whole episode.

    Raises:
        RobotError: the robot takes no commands.
        PdtuiError: robot, policy or map cannot be had.
    """
    built = build_loop(config)
    robot, policy = built.robot, built.policy
    ranges = {name: one for name, one in robot.command_ranges.items() if name in robot.commands}
    if not ranges:
        raise RobotError(f"{robot.name}: it takes no commands that could be followed")
    columns = [robot.attribute_index(one.attribute) for one in ranges.values()]
    asked, errors, biases, finished = [], [], [], 0
    for done, seed in enumerate(seeds, start=1):
        rng = np.random.default_rng(seed)
        wanted = np.array([rng.uniform(one.low, one.high) for one in ranges.values()])
        loop = ControlLoop(robot, policy, _asking(built.map, dict(zip(ranges, wanted, strict=True))), seed)
        records = list(run_episode(loop, robot.episode_steps, _ask_at_start))
        values = [record.attributes[columns] for record in records]
        settled = np.array(values[SETTLED:] or values[-1:])
        asked.append(wanted)
        errors.append(np.abs(settled - wanted).mean(axis=0))
        biases.append(np.abs(settled.mean(axis=0) - wanted))
        finished += not records[-1].fell
        if progress is not None:
            progress(done, len(seeds))
    rows = []
    for index, (name, column) in enumerate(zip(ranges, columns, strict=True)):
        error = np.array(errors)[:, index]
        rows.append(
            CommandTracking(
                name,
                robot.attributes[column].unit,
                tuple(np.array(asked)[:, index].tolist()),
                float(error.mean()),
                *confidence_interval(error),
                float(np.array(biases)[:, index].mean()),
            )
        )
    return CommandFollowingResult(
        robot.name, policy.name, tuple(seeds), robot.episode_steps, tuple(rows), finished
    )


def _ask_at_start(step: int) -> list[Event]:
    return [Event(0, "behavior", _ASKED)] if step == 0 else []


def _asking(shipped: StimulationMap, commands: dict[str, float]) -> StimulationMap:
    """The map with one behavior: to ask for these."""
    behavior = Behavior(_ASKED, "a", "asks for commands", {}, commands=commands)
    return replace(shipped, primitives={}, behaviors={_ASKED: behavior})
