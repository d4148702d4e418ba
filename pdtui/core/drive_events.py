"""Events: everything that changes a run, each stamped with the control step before which it applies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pdtui.core.reserved_keys import EVENT_WORDINGS, JUMPS, EventKind


@dataclass(frozen=True)
class DriveEvent:
    """One change of the run.

    Attributes:
        step: the control step before which the event applies; the first step is 0.
        kind: ``behavior`` latches `name`; ``default`` clears all behaviors and ends a takeover;
            ``target`` sets the target of `name` to `value`; ``factor`` sets the magnitudes of `name` to
            `value` times the map's; ``takeover`` takes over all manual controls, at 0; ``control`` sets the
            control `name` to `value`, and takes it over if it was not; ``hand back`` hands all controls back
            to the policy; ``reset`` starts the next episode; ``rewind`` restores the state before step
            `value`. Those of the unit bench are ``unit``, which holds unit `name` at `value`, and ``free``,
            which lets it go; ``beside`` latches `name` and ends no other; ``release`` lets go of `name`
            alone; ``mute`` and ``unmute``; ``order`` moves `name` to place `value` of the stack, 0 for the
            lowest; ``kp``, ``ki`` and ``kd`` set a gain of `name`.
        name: name of the behavior or of the control, or address of the unit.
        value: target, factor, value of the control, step, output v of the unit, place, or gain.
        key: the key that the operator pressed, `EDIT_KEY` for an edit; empty if the event has another cause.
    """

    step: int
    kind: EventKind
    name: str = ""
    value: float = 0.0
    key: str = ""

    @property
    def jumps(self) -> bool:
        """Whether the event puts the robot into a different state."""
        return self.kind in JUMPS


def describe_event(event: DriveEvent) -> str:
    """Say what an event does: the wording of the screen, the session's log and ``pdtui sessions``."""
    return EVENT_WORDINGS[event.kind].format(name=event.name, value=event.value)


def group_events_by_step(events: Iterable[DriveEvent]) -> dict[int, list[DriveEvent]]:
    """Return events by the control step before which they apply, each list in order."""
    grouped: dict[int, list[DriveEvent]] = {}
    for event in events:
        grouped.setdefault(event.step, []).append(event)
    return grouped
