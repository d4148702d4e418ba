"""How closely a policy follows the commands that it is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from rich.table import Table

from pdtui.core.confidence_intervals import confidence_interval
from pdtui.core.console.text_tables import format_mean_with_interval, format_seed_range, new_table
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome, OutcomeCounts, count_failures, count_outcomes
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import run_episode
from pdtui.driving.loop_builder import build_control_loop
from pdtui.stimulation.stimulation_map import Behavior

SETTLED = 100
"""Control steps at the start of an episode that do not count: the robot has to get into its gait."""
_ASKED = "asked"


@dataclass(frozen=True)
class CommandTrackingError:
    """How closely one command is followed: mean |attribute − command| and its 95 % interval over seeds.

    Attributes:
        asked: value of the command on each seed.
        bias: mean over seeds of |mean attribute − command|, which averages the gait out.
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
    """How closely a policy follows its commands.

    Attributes:
        seeds: seeds of the episodes; each draws its own commands.
        steps: control steps per episode; the first 100 do not count.
        outcomes: how the episodes ended; those that lasted all steps are out of time.
    """

    robot: str
    policy: str
    seeds: tuple[int, ...]
    steps: int
    commands: tuple[CommandTrackingError, ...]
    outcomes: OutcomeCounts


def evaluate_command_following(
    config: DriveConfig, seeds: Sequence[int], *, progress: StepProgress | None = None
) -> CommandFollowingResult:
    """Run an episode per seed with constant commands, drawn from the ranges of the training.

    Raises:
        RobotError: the robot takes no commands.
        PdtuiError: the robot, policy or map cannot be loaded.
    """
    built = build_control_loop(config)
    robot, policy, steps = built.robot, built.policy, built.robot.episode_steps
    ranges = {name: one for name, one in robot.command_ranges.items() if name in robot.commands}
    if not ranges:
        raise RobotError(f"{robot.name}: it takes no commands")
    columns = [robot.attribute_index(one.attribute) for one in ranges.values()]
    asked, errors, biases, outcomes = [], [], [], []
    press = {0: [DriveEvent(0, "behavior", _ASKED)]}
    for done, seed in enumerate(seeds, start=1):
        rng = np.random.default_rng(seed)
        wanted = np.array([rng.uniform(one.low, one.high) for one in ranges.values()])
        behavior = Behavior(_ASKED, "a", "sets commands", {}, commands=dict(zip(ranges, wanted, strict=True)))
        only_commands = replace(built.map, primitives={}, behaviors={_ASKED: behavior})
        loop = ControlLoop(robot, policy, only_commands, seed)
        records = list(run_episode(loop, steps, lambda step: press.get(step, [])))
        values = [record.attributes[columns] for record in records]
        settled = np.array(values[SETTLED:] or values[-1:])
        asked.append(wanted)
        errors.append(np.abs(settled - wanted).mean(axis=0))
        biases.append(np.abs(settled.mean(axis=0) - wanted))
        outcomes.append(records[-1].outcome or Outcome.OUT_OF_TIME)
        if progress is not None:
            progress(done, len(seeds))
    rows = []
    for index, (name, column) in enumerate(zip(ranges, columns, strict=True)):
        error = np.array(errors)[:, index]
        rows.append(
            CommandTrackingError(
                name,
                robot.attributes[column].unit,
                tuple(np.array(asked)[:, index].tolist()),
                float(error.mean()),
                *confidence_interval(error),
                float(np.array(biases)[:, index].mean()),
            )
        )
    counts = count_outcomes(outcomes, robot.outcomes)
    return CommandFollowingResult(robot.name, policy.name, tuple(seeds), steps, tuple(rows), counts)


def command_following_table(result: CommandFollowingResult) -> Table:
    """Return a table with one row per command."""
    table = new_table(
        f"{result.robot}, policy {result.policy}, {format_seed_range(result.seeds)}, "
        f"{result.steps} steps each",
        *("command", "asked", "mean |error| [95 %]", "without the gait", "falls"),
    )
    count = len(result.seeds)
    for row in result.commands:
        table.add_row(
            f"{row.command} ({row.unit})",
            f"{min(row.asked):+.2f} to {max(row.asked):+.2f}",
            format_mean_with_interval(row.error, row.low, row.high, ".3f"),
            f"{row.bias:.3f}",
            f"{count_failures(result.outcomes)}/{count}",
        )
    return table
