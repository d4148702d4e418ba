"""Turns pressed keys into events, and keystroke files into pressed keys."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from pdtui.core.drive_edits import (
    EDIT_KEY,
    FACTOR_STEP,
    NAMED_EDITS,
    VALUED_EDITS,
    edit_subject,
    is_edit,
    parse_edit,
    write_edit,
)
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import KeystrokeError
from pdtui.core.reserved_keys import RUN_KEYS, ReservedKey
from pdtui.core.step_record import ActiveBehavior
from pdtui.core.untrusted_file import KEYSTROKES_BUDGET, describe_bytes
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.manual_takeover import NO_CONTROLS
from pdtui.stimulation.stimulation_map import StimulationMap

MAX_PRESSES = 200_000
"""Key presses of a file: a key in every step of an hour, at 50 Hz, is 180,000."""
MAX_PRESSES_PER_STEP = 100
"""Key presses before one step."""
REWIND_SECONDS = 3.0
_LINE = re.compile(r"(\d{1,9})\s+(\S.*)")
_KEY = re.compile(r"\S+")


def list_drive_keys(stimulation_map: StimulationMap) -> tuple[str, ...]:
    """Return every key that can change a run driven with this map."""
    behaviors = (behavior.key for behavior in stimulation_map.behaviors.values())
    return stimulation_map.default_key, *behaviors, *RUN_KEYS


def interpret_key(key: str, loop: ControlLoop) -> DriveEvent | str:
    """Return the event of a key or an edit in the loop's present state, or a sentence on why it has none."""
    if is_edit(key):
        return parse_edit(key, loop.step)
    if key == loop.map.default_key:
        return DriveEvent(loop.step, "default", key=key)
    behavior = loop.map.behavior_of_key(key)
    if behavior is not None:
        return DriveEvent(loop.step, "behavior", behavior.name, key=key)
    if key not in RUN_KEYS:
        return f"no behavior has key '{key}'"
    row = RUN_KEYS[key]
    match row.event:
        case "target":
            return _target_event(row, loop)
        case "factor":
            return _factor_event(row, loop)
        case "takeover":
            return _takeover_event(row, loop)
        case "rewind":
            return _rewind_event(row, loop)
        case kind:
            assert kind is not None
            return DriveEvent(loop.step, kind, key=key)


def interpret_keys(keys: Iterable[str], loop: ControlLoop) -> list[DriveEvent | str]:
    """Interpret keys and edits before the same step, each in the state that those before it lead to."""
    meanings: list[DriveEvent | str] = []
    with loop.rehearsal() as rehearse:
        for key in keys:
            try:
                meaning = interpret_key(key, loop)
                if isinstance(meaning, DriveEvent):
                    rehearse(meaning)
            except KeystrokeError as error:  # an edit of something that is not there
                meaning = str(error)
            meanings.append(meaning)
    return meanings


def note_press(pressed: list[str], key: str) -> None:
    """Append a key or an edit to those pressed before a step.

    Of edits of the same thing in a row, such as a slider sends many of, only the last one counts.
    """
    before = pressed[-1] if pressed else ""
    if is_edit(key) and is_edit(before) and edit_subject(key) == edit_subject(before):
        pressed.pop()
    pressed.append(key)


def _factor_event(row: ReservedKey, loop: ControlLoop) -> DriveEvent | str:
    if not loop.latch.active:
        return "no behavior is latched, so there is no strength to change"
    latest = loop.latch.active[-1]
    return DriveEvent(loop.step, "factor", latest.name, latest.factor * FACTOR_STEP**row.direction, row.key)


def _rewind_event(row: ReservedKey, loop: ControlLoop) -> DriveEvent | str:
    target = loop.history.step_before(loop.step, round(REWIND_SECONDS / loop.robot.control_dt))
    if target is None:
        return "nothing to rewind to yet"
    return DriveEvent(loop.step, "rewind", value=float(target), key=row.key)


def _takeover_event(row: ReservedKey, loop: ControlLoop) -> DriveEvent | str:
    if not loop.robot.manual_controls:
        return f"{loop.robot.name} {NO_CONTROLS}"
    return DriveEvent(loop.step, "hand back" if loop.takeover.values else "takeover", key=row.key)


def _target_event(row: ReservedKey, loop: ControlLoop) -> DriveEvent | str:
    """Return the event of an arrow: during a takeover, it changes a control.

    Otherwise, left and right move the target of a heading, up and down any other.
    """
    control = loop.takeover.control_of_arrow(row.key)
    if control is not None:
        changed = loop.takeover.values[control.name] + row.direction * control.step
        # Rounded, so that as many presses forth and back lead to 0.
        value = min(1.0, max(-1.0, round(changed, 9)))
        return DriveEvent(loop.step, "control", control.name, value, row.key)
    held = [view for view in loop.latch.active if view.target is not None]
    if not held:
        return "no target is held; only behaviors of mode pid hold one"

    def turns(view: ActiveBehavior) -> bool:
        pid = loop.map.behaviors[view.name].pid
        assert pid is not None
        return loop.robot.attributes[loop.robot.attribute_index(pid.attribute)].wraps

    sideways = row.key in ("left", "right")
    chosen = next((view for view in held if turns(view) == sideways), held[-1])
    pid = loop.map.behaviors[chosen.name].pid
    assert pid is not None
    assert chosen.target is not None
    return DriveEvent(loop.step, "target", chosen.name, chosen.target + row.direction * pid.step, row.key)


def read_keystrokes(path: Path, stimulation_map: StimulationMap) -> dict[int, list[str]]:
    """Return key presses by control step from a text file with one ``STEP KEY`` or ``STEP EDIT`` per line.

    ``#`` starts a comment. A `KeystrokeError` names the file or the line that is wrong.
    """
    try:
        with path.open("rb") as file:  # it may be a pipe
            read = file.read(KEYSTROKES_BUDGET.bytes + 1)
        if len(read) > KEYSTROKES_BUDGET.bytes:
            limit = describe_bytes(KEYSTROKES_BUDGET.bytes)
            raise KeystrokeError(f"{path}: expected keystrokes of at most {limit}, found more")
        lines = read.decode("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise KeystrokeError(f"{path}: cannot be read as keystrokes: {reason}") from error
    keys = list_drive_keys(stimulation_map)
    known, count = frozenset(keys), 0
    presses: dict[int, list[str]] = {}
    last = 0
    for number, line in enumerate(lines, start=1):
        content = line.split("#")[0].strip()
        if not content:
            continue
        match = _LINE.fullmatch(content)
        if match is None:
            raise KeystrokeError(f"{path}:{number}: expected 'STEP KEY', found {content[:40]!r}")
        step, key = int(match[1]), match[2]
        if is_edit(key):
            try:
                parse_edit(key, step)
            except KeystrokeError as error:
                raise KeystrokeError(f"{path}:{number}: {error}") from error
        elif key not in known:
            raise KeystrokeError(
                f"{path}:{number}: key '{key[:40]}' does nothing; keys are {', '.join(keys)[:1000]}"
            )
        if step < last:
            raise KeystrokeError(
                f"{path}:{number}: step {step} comes after step {last}; steps must not go back"
            )
        last, count = step, count + 1
        pressed = presses.setdefault(step, [])
        pressed.append(key)
        if len(pressed) > MAX_PRESSES_PER_STEP or count > MAX_PRESSES:
            raise KeystrokeError(
                f"{path}:{number}: expected at most {MAX_PRESSES_PER_STEP} keys in a step and "
                f"{MAX_PRESSES} in all, found more"
            )
    return presses


def format_keystrokes(events: Iterable[DriveEvent]) -> str:
    """Return the key presses and edits among events as the text of a keystroke file."""
    lines = []
    for event in events:
        edits = event.key == EDIT_KEY and event.kind in (*VALUED_EDITS, *NAMED_EDITS)
        pressed = write_edit(event.kind, event.name, event.value) if edits else event.key
        if pressed and ((not edits and _KEY.fullmatch(pressed) is None) or "#" in pressed):
            raise KeystrokeError(f"step {event.step}: {pressed[:40]!r} is not the name of a key")
        lines += [f"{event.step} {pressed}\n"] if pressed else []
    return "".join(lines)
