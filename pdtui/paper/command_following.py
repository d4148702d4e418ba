"""How closely a policy follows the commands that it is given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pdtui.core.errors import RobotError
from pdtui.core.events import Event
from pdtui.core.intervals import confidence_interval
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import run_episode
from pdtui.driving.loop_builder import build_loop
from pdtui.stimulation.stimulation_map import Behavior, StimulationMap

SETTLED = 100
"""Control steps at the start of an episode that do not count: the robot has to get into its gait."""
_ASKED = "asked"


@dataclass(frozen=True)
class CommandTracking:
    """How closely one command is followed, over all seeds.

    Attributes:
        command, unit: name and unit of the command.
        asked: value of the command on each seed.
        error, low, high: mean |attribute − command| over steps and seeds, with its 95 % interval over seeds.
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
        robot, policy: names of robot and policy.
        seeds: seeds of the episodes; each draws its own commands.
        steps: control steps per episode; the first 100 do not count.
        commands: result of each command.
        finished: number of episodes without a fall.
    """

    robot: str
    policy: str
    seeds: tuple[int, ...]
    steps: int
    commands: tuple[CommandTracking, ...]
    finished: int

    def as_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        return asdict(self)


def evaluate_command_following(
    config: DriveConfig, seeds: Sequence[int], *, progress: Callable[[int, int], None] | None = None
) -> CommandFollowingResult:
    """Run an episode per seed with constant commands, drawn from the ranges of the training.

    Raises:
        RobotError: the robot takes no commands.
        PdtuiError: the robot, policy or map cannot be loaded.
    """
    built = build_loop(config)
    robot, policy = built.robot, built.policy
    ranges = {name: one for name, one in robot.command_ranges.items() if name in robot.commands}
    if not ranges:
        raise RobotError(f"{robot.name}: it takes no commands")
    columns = [robot.attribute_index(one.attribute) for one in ranges.values()]
    asked, errors, biases, finished = [], [], [], 0
    for done, seed in enumerate(seeds, start=1):
        rng = np.random.default_rng(seed)
        wanted = np.array([rng.uniform(one.low, one.high) for one in ranges.values()])
        loop = ControlLoop(
            robot, policy, _map_with_commands(built.map, dict(zip(ranges, wanted, strict=True))), seed
        )
        records = list(run_episode(loop, robot.episode_steps, _press_at_start))
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


def _press_at_start(step: int) -> list[Event]:
    return [Event(0, "behavior", _ASKED)] if step == 0 else []


def _map_with_commands(shipped: StimulationMap, commands: dict[str, float]) -> StimulationMap:
    """Return the map with a single behavior, which sets these commands."""
    behavior = Behavior(_ASKED, "a", "sets commands", {}, commands=commands)
    return replace(shipped, primitives={}, behaviors={_ASKED: behavior})
