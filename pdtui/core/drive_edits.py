"""Edits: changes of a run that name what they change, instead of being a key; as text, and as events.

An edit is a line such as ``unit 0:12 1.5`` or ``mute turn left``: the kind of its event, a name that may
contain blanks, and a value where the kind has one. A key's name contains no blank, so an edit can stand
wherever a key can: in the pipe to a drive, in a keystroke file, and in `pdtui.drive`.
"""

from __future__ import annotations

import math

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError
from pdtui.core.reserved_keys import EventKind

EDIT_KEY = "edit"
"""Stands for the key in the event of an edit, which counts as human involvement like a key."""
FACTOR_STEP = 1.25
"""Factor by which one press of a key strengthens or weakens a behavior."""
VALUED_EDITS: tuple[EventKind, ...] = ("unit", "factor", "target", "order", "kp", "ki", "kd", "limit")
"""Kinds of events that an edit can make, with a value."""
NAMED_EDITS: tuple[EventKind, ...] = ("free", "beside", "release", "mute", "unmute")
"""Kinds of events that an edit can make, without a value."""


def is_edit(pressed: str) -> bool:
    """Return whether a text is an edit, and not the name of a key."""
    return " " in pressed


def write_edit(kind: EventKind, name: str, value: float = 0.0) -> str:
    """Return an edit as text; `parse_edit` returns exactly the same kind, name and value."""
    number = repr(value).removesuffix(".0")
    return f"{kind} {name} {number}" if kind in VALUED_EDITS else f"{kind} {name}"


def parse_edit(text: str, step: int) -> DriveEvent:
    """Return the event of an edit before a control step; a text that is none is a `KeystrokeError`."""
    kind, _, rest = text.strip().partition(" ")
    name, value = rest.strip(), 0.0
    if (known := next((one for one in VALUED_EDITS if one == kind), None)) is not None:
        name, _, number = name.rpartition(" ")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise KeystrokeError(
                f"{text[:80]!r}: expected '{kind} NAME VALUE', found {number[:40]!r} as value"
            )
    elif (known := next((one for one in NAMED_EDITS if one == kind), None)) is None:
        kinds = ", ".join((*VALUED_EDITS, *NAMED_EDITS))
        raise KeystrokeError(f"{text[:80]!r}: no edit '{kind[:40]}'; available: {kinds}")
    if not name:
        raise KeystrokeError(f"{text[:80]!r}: expected the name of what '{kind}' changes")
    return DriveEvent(step, known, name.strip(), value, EDIT_KEY)


def edit_subject(text: str) -> tuple[str, str]:
    """Return kind and name of an edit, which a later edit of the same replaces before it has acted."""
    kind, _, rest = text.partition(" ")
    return kind, rest.rpartition(" ")[0] if kind in VALUED_EDITS else rest
