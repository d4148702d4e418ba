"""A ghost that is more than the drive without its behaviors: another map, policy or magnitude."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pdtui.core.drive_events import DriveEvent

if TYPE_CHECKING:
    from pdtui.core.step_record import StepRecord
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.stimulation.stimulation_map import StimulationMap

_KEYED = ("behavior", "default", "target", "factor")


@dataclass(frozen=True)
class GhostVariant:
    """What is other in the ghost than in the drive.

    Attributes:
        label: what the screen calls the ghost.
        config: the drive of the ghost, with its own map and policy; None for those of the drive.
        factor: factor by which the ghost's magnitudes are those of the drive; None for no behaviors at all
            unless there is a `config`.
    """

    label: str
    config: DriveConfig | None = None
    factor: float | None = None

    @property
    def has_other_policy(self) -> bool:
        """Whether the ghost differs also while no behavior is latched."""
        return self.config is not None

    def configure(self, drive: DriveConfig) -> DriveConfig:
        """Return what the ghost's process builds its loop from."""
        return drive if self.config is None else replace(self.config, seed=drive.seed, start=drive.start)

    def list_events(
        self, record: StepRecord, stimulation_map: StimulationMap, *, first: bool
    ) -> list[DriveEvent]:
        """Return the events of the ghost that follow from those of the drive's control step.

        A behavior of another map is the one with the same key. In the ghost's first step, it begins with
        what is latched in the drive.
        """
        events: list[DriveEvent] = []
        if first:
            latched = [DriveEvent(record.step, "behavior", view.name) for view in record.behaviors]
            factors = [(view.name, view.factor) for view in record.behaviors if view.factor != 1.0]
            followed = [*latched, *(DriveEvent(record.step, "factor", *factor) for factor in factors)]
        else:
            followed = [event for event in record.events if event.kind in _KEYED]
        for event in followed:
            name = event.name and self._find_behavior(event.name, stimulation_map)
            if event.name and not name:
                continue
            scale = 1.0 if self.factor is None else self.factor
            value = event.value * scale if event.kind == "factor" else event.value
            events.append(replace(event, name=name, value=value, key=""))
            if event.kind == "behavior" and scale != 1.0:
                events.append(DriveEvent(event.step, "factor", name, scale))
        return events

    def _find_behavior(self, name: str, stimulation_map: StimulationMap) -> str:
        """Return the ghost's behavior for one of the drive; empty if it has none."""
        behavior = stimulation_map.behaviors.get(name)
        if self.config is None or behavior is None:
            return name
        other = self.config.stimulation_map.behavior_of_key(behavior.key)
        return "" if other is None else other.name
