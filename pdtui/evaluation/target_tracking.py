"""`pdtui evaluate --target ATTRIBUTE`: how precisely a PID behavior holds an attribute."""

from __future__ import annotations

from collections.abc import Sequence

from pdtui.core.errors import MapError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.driving.drive_config import DriveConfig
from pdtui.search.tracking_drives import TrackingDriveJob, TrackingDriveRunner
from pdtui.search.tracking_summary import TrackingSummary, choose_tracking_targets, summarize_tracking
from pdtui.stimulation.stimulation_map import Behavior


def evaluate_target_tracking(
    config: DriveConfig,
    attribute: str,
    seeds: Sequence[int],
    *,
    targets: Sequence[float] = (),
    workers: int = 1,
    progress: StepProgress | None = None,
) -> TrackingSummary:
    """Drive every seed through the targets, 100 control steps each, with the PID behavior and without.

    The targets are in the attribute's unit, and by default those of `choose_tracking_targets`. The seed of
    `config` is not used.

    Raises:
        MapError: the map has no behavior of mode ``pid`` for the attribute.
        PdtuiError: the robot or policy cannot be loaded.
    """
    behavior = find_pid_behaviors(config, attribute)[0]
    with TrackingDriveRunner(config, workers) as runner:
        chosen = tuple(targets) or choose_tracking_targets(runner, behavior, seeds[:3])
        drives = [
            TrackingDriveJob(attribute, name, seed, chosen) for name in (behavior.name, "") for seed in seeds
        ]
        results = runner.run(drives, progress)
        unit = runner.attribute(attribute).unit
    return summarize_tracking(results[: len(seeds)], unit, results[len(seeds) :])


def find_pid_behaviors(config: DriveConfig, attribute: str) -> list[Behavior]:
    """Return the map's behaviors of mode ``pid`` that hold an attribute, at least one.

    Raises:
        MapError: there is none.
    """
    behaviors = config.stimulation_map.behaviors.values()
    held = {one.name: one.pid.attribute for one in behaviors if one.pid is not None}
    if attribute not in held.values():
        known = ", ".join(held.values()) or "none"
        raise MapError(
            f"{config.stimulation_map.source}: no behavior of mode pid holds '{attribute}'; held are: {known}"
        )
    return [one for one in behaviors if held.get(one.name) == attribute]
