"""Whether a robot turns by a right angle and back when the target of its heading says so."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from pdtui.core.attributes import wrap_angles
from pdtui.core.console.text_tables import format_seed_range, new_table
from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import run_episode
from pdtui.driving.loop_builder import build_control_loop
from pdtui.evaluation.paired_statistics import share_interval
from pdtui.evaluation.target_tracking import find_pid_behaviors

PRESSED, HELD, JUDGED = 100, 400, 100
"""Control steps until the key is pressed, for each heading, and those at its end that are judged."""
ALLOWED = 0.3
"""Largest mean deviation from a heading at which it counts as held, rad."""


@dataclass(frozen=True)
class HeadingRedirectDrive:
    """One drive: a right angle to one side, then back.

    Attributes:
        seed: Seed of the drive.
        side: ``left`` or ``right``.
        there, back: Mean deviation from the heading at the end of each part, rad; NaN if it ended before.
        outcome: How the episode ended; None if it lasted.
        done: Whether it lasted, and both deviations are at most `ALLOWED`.
    """

    seed: int
    side: str
    there: float
    back: float
    outcome: Outcome | None
    done: bool


@dataclass(frozen=True)
class HeadingRedirectMeasurement:
    """The drives of one behavior that holds a heading."""

    robot: str
    policy: str
    behavior: str
    seeds: tuple[int, ...]
    drives: tuple[HeadingRedirectDrive, ...]


def measure_heading_redirects(
    config: DriveConfig, seeds: Sequence[int], *, progress: StepProgress | None = None
) -> HeadingRedirectMeasurement:
    """Redirect the robot to the left and back, and to the right and back, once each per seed.

    The first behavior of the map that holds a yaw is pressed before control step 100, with a target that is a
    right angle from the heading at that moment. 400 control steps later, the target is that heading itself.

    Raises:
        MapError: The map has no behavior of mode ``pid`` that holds a yaw.
        PdtuiError: The robot, policy or map cannot be loaded.
    """
    behavior, built = find_pid_behaviors(config, "yaw")[0].name, build_control_loop(config)
    found: list[HeadingRedirectDrive] = []
    for seed in seeds:
        for side, sign in (("left", 1.0), ("right", -1.0)):
            loop = ControlLoop(built.robot, built.policy, built.map, seed)
            found.append(_redirect(loop, behavior, seed, side, sign))
            if progress is not None:
                progress(len(found), 2 * len(seeds))
    return HeadingRedirectMeasurement(
        built.robot.name, built.policy.name, behavior, tuple(seeds), tuple(found)
    )


def _redirect(loop: ControlLoop, behavior: str, seed: int, side: str, sign: float) -> HeadingRedirectDrive:
    column, before = loop.robot.attribute_index("yaw"), 0.0

    def events_before(step: int) -> list[DriveEvent]:
        nonlocal before
        if step == PRESSED:
            before = float(loop.attributes[column])
            turned = math.remainder(before + sign * math.pi / 2, 2 * math.pi)
            return [DriveEvent(step, "behavior", behavior), DriveEvent(step, "target", behavior, turned)]
        return [DriveEvent(step, "target", behavior, before)] if step == PRESSED + HELD else []

    steps = PRESSED + 2 * HELD
    records = list(run_episode(loop, steps, events_before))
    yaws = np.full(steps, np.nan)
    yaws[: len(records)] = [record.attributes[column] for record in records]
    errors = []
    for end, target in ((PRESSED + HELD, before + sign * math.pi / 2), (steps, before)):
        errors.append(abs(float(wrap_angles(yaws[end - JUDGED : end] - target).mean())))
    lasted = len(records) == steps and not records[-1].ended
    done = lasted and max(errors) <= ALLOWED
    return HeadingRedirectDrive(seed, side, errors[0], errors[1], records[-1].outcome, done)


def heading_redirect_table(result: HeadingRedirectMeasurement) -> Table:
    """Return a table with one row per side."""
    table = new_table(
        f"{result.robot}, policy {result.policy}: '{result.behavior}', {format_seed_range(result.seeds)}",
        *("", "done [95 %]", "off there (rad)", "off back (rad)", "did not last"),
    )
    for side in ("left", "right"):
        drives = [one for one in result.drives if one.side == side]
        done, count = sum(one.done for one in drives), len(drives)
        low, high = share_interval(done, count)
        there, back = ([getattr(one, name) for one in drives] for name in ("there", "back"))
        table.add_row(
            f"90° to the {side} and back",
            f"{done} of {count} [{low:.2f}, {high:.2f}]",
            f"{np.nanmean(there):.3f}",
            f"{np.nanmean(back):.3f}",
            f"{sum(bool(np.isnan(one.back)) for one in drives)}",
        )
    return table
