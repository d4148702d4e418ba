"""Events: everything that changes a run, each stamped with the control step before which it applies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pdtui.core.key_table import EVENT_WORDINGS, EventKind


@dataclass(frozen=True)
class Event:
    """One change of the run.

    Attributes:
        step: it applies before this control step; the first is 0.
        kind: ``behavior`` latches `name`; ``default`` clears everything; ``target`` moves the target of
            `name` to `value`; ``factor`` scales the magnitudes of `name` to `value` times the map's;
            ``reset`` starts the next episode; ``rewind`` restores the state before step `value`.
        name: of the behavior.
        value: target, factor or step.
        key: what the operator pressed, empty if no key did it.
    """

    step: int
    kind: EventKind
    name: str = ""
    value: float = 0.0
    key: str = ""

    @property
    def jumps(self) -> bool:
        """Whether the robot is put into another state than the one it was in."""
        return EVENT_WORDINGS[self.kind].jumps


def describe_event(event: Event) -> str:
    """Say what an event does: the wording of the screen, the session's log and ``pdtui sessions``."""
    return EVENT_WORDINGS[event.kind].sentence.format(name=event.name, value=event.value)


def group_events_by_step(events: Iterable[Event]) -> dict[int, list[Event]]:
    """Events by the control step before which they apply, in their order."""
    grouped: dict[int, list[Event]] = {}
    for event in events:
        grouped.setdefault(event.step, []).append(event)
    return grouped
