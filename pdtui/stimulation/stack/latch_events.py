"""What the events of a drive do to its latch."""

from __future__ import annotations

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError
from pdtui.stimulation.behavior_latch import BehaviorLatch


def apply_latch_event(latch: BehaviorLatch, event: DriveEvent, attributes: Floats) -> None:
    """Apply an event that latches or changes something.

    Args:
        latch: The latch.
        event: The event.
        attributes: The robot's present attributes, shape (J,).

    Raises:
        KeystrokeError: The event names what is not there, or its kind is none of a latch.
    """
    match event.kind:
        case "behavior":
            latch.latch_behavior(event.name, attributes)
        case "beside":
            latch.latch_behavior(event.name, attributes, beside=True)
        case "release":
            latch.release_behavior(event.name)
        case "mute" | "unmute":
            latch.set_muted(event.name, muted=event.kind == "mute")
        case "order":
            latch.move_behavior(event.name, event.value)
        case "target":
            latch.controller_of(event.name).set_target(event.value)
        case "factor":
            latch.set_factor(event.name, event.value)
        case "kp" | "ki" | "kd" | "limit":
            latch.controller_of(event.name).set_gain(event.kind, event.value)
        case "unit":
            latch.held.hold(event.name, event.value)
        case "free":
            latch.held.free(event.name)
        case _:
            raise KeystrokeError(f"step {event.step}: unknown event '{event.kind}'")
