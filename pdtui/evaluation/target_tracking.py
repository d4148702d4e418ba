"""`pdtui evaluate --target yaw`: how precisely a PID holds an attribute, any that a map can hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pdtui.core.errors import MapError
from pdtui.drive.drive_config import DriveConfig
from pdtui.search.tracking_drives import TrackingDrive, TrackingDriveRunner
from pdtui.search.tracking_summary import (
    TrackingSummary,
    choose_tracking_targets,
    finite_mean,
    seed_errors,
    summarise_tracking,
)
from pdtui.stimulation.stimulation_map import Behavior


def evaluate_tracking(
    config: DriveConfig,
    attribute: str,
    seeds: Sequence[int],
    *,
    targets: Sequence[float] = (),
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> TrackingSummary:
    """Set the targets one after the other, 100 control steps each, on every seed; and once without control.

    Args:
        config: robot, map and policy; its seed is not used.
        attribute: what is to be held.
        seeds: of the resets.
        targets: in the attribute's unit; empty takes `choose_tracking_targets`.
        workers: processes.
        progress: called with drives done and drives in all.

    Raises:
        MapError: the map has no behavior of mode ``pid`` for the attribute.
        PdtuiError: robot or policy cannot be had.
    """
    behavior = holding_behavior(config, attribute)
    with TrackingDriveRunner(config, workers) as runner:
        targets = tuple(targets) or choose_tracking_targets(runner, behavior, seeds[:3])
        drives = [
            TrackingDrive(attribute, name, seed, tuple(targets))
            for name in (behavior.name, "")
            for seed in seeds
        ]
        followed = runner.run(drives, progress)
        unit = runner.attribute(attribute).unit
    untouched = finite_mean(seed_errors(followed[len(seeds) :]))
    return summarise_tracking(followed[: len(seeds)], unit, untouched)


def holding_behavior(config: DriveConfig, attribute: str) -> Behavior:
    """The behavior that holds an attribute; of several, the first.

    Raises:
        MapError: there is none.
    """
    holding = [one for one in config.stimulation_map.behaviors.values() if one.pid is not None]
    for behavior in holding:
        if behavior.pid is not None and behavior.pid.attribute == attribute:
            return behavior
    known = ", ".join(one.pid.attribute for one in holding if one.pid is not None) or "none"
    raise MapError(
        f"{config.stimulation_map.source}: no behavior of mode pid holds '{attribute}'; held are: {known}"
    )
