"""What the index at the end of a session contains: all but the data of its control steps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from typing import Any

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.core.outcome import Outcome
from pdtui.core.reserved_keys import EVENT_WORDINGS
from pdtui.sessions.drive_info import decode_drive_info
from pdtui.sessions.recorded_outcomes import decode_outcomes

_MAX_STEPS = 1 << 40


def build_session_index(
    drive: Mapping[str, Any],
    versions: Mapping[str, str],
    *,
    steps: int,
    events: Sequence[DriveEvent],
    endings: Mapping[int, str],
    outcomes: Mapping[int, Outcome],
    outcome: str,
    gaps: Sequence[tuple[int, int]] = (),
    summary: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the index of a session as plain data.

    Args:
        drive: the properties of the drive, as `encode_drive_info` returns them.
        versions: versions of the machine and the libraries.
        steps: number of control steps.
        events: the events, in the order in which they were applied.
        endings: why episodes ended by themselves, by the control step that ended each.
        outcomes: how episodes ended, or that their task was done, by the control step.
        outcome: how the drive ended.
        gaps: ranges of control steps that a repair could not rescue, each without its end.
        summary: the fields of a `SessionSummary`, if it was computed.
    """
    return {
        "drive": dict(drive),
        "versions": dict(versions),
        "steps": steps,
        "events": [list(astuple(event)) for event in events],
        "endings": [[step, reason] for step, reason in endings.items()],
        "outcomes": [[step, outcome.value] for step, outcome in outcomes.items()],
        "outcome": outcome,
        "gaps": [list(gap) for gap in gaps],
        "summary": dict(summary) if summary is not None else None,
    }


def decode_session_index(index: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a `SessionHeader`, except its path, trusting nothing in the index.

    An index that is not as expected is a `SessionError`.
    """
    try:
        drive = {
            name: value if isinstance(value, list) else [value] for name, value in index["drive"].items()
        }
        info, created = decode_drive_info(drive)
        versions = {str(name): str(value) for name, value in index["versions"].items()}
        endings = {_check_step(step): _check_text(reason) for step, reason in index["endings"]}
        outcomes = [(_check_step(step), word) for step, word in index.get("outcomes", ())]
        return {
            "info": info,
            "created": created,
            "versions": versions,
            "steps": _check_step(index["steps"]),
            "events": tuple(decode_event(*event) for event in index["events"]),
            "endings": endings,
            "outcomes": decode_outcomes(outcomes, endings),
            "outcome": _check_text(index["outcome"]),
            "gaps": decode_gaps(index["gaps"]),
        }
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SessionError(f"the file's index is not as expected: {error!r}") from error


def decode_event(step: Any, kind: Any, name: Any, value: Any, key: Any) -> DriveEvent:
    """Return an event; one that is not as expected is a `SessionError` or a `ValueError`."""
    if kind not in EVENT_WORDINGS:
        raise SessionError(f"unknown event '{str(kind)[:40]}'; available: {', '.join(EVENT_WORDINGS)}")
    if type(value) not in (int, float):
        raise ValueError(f"the value of an event is no number: {str(value)[:40]}")
    return DriveEvent(_check_step(step), kind, _check_text(name), float(value), _check_text(key))


def decode_gaps(gaps: Any) -> tuple[tuple[int, int], ...]:
    """Return ranges of missing control steps; those that are not in order are a `ValueError`."""
    found = tuple((_check_step(first), _check_step(end)) for first, end in gaps)
    before = -math.inf
    for first, end in found:
        if not before < first < end:
            raise ValueError("the gaps are not in order")
        before = end
    return found


def _check_step(value: Any) -> int:
    if type(value) is not int or not 0 <= value < _MAX_STEPS:
        raise ValueError(f"expected the number of a control step, found {str(value)[:40]}")
    return value


def _check_text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"expected text, found {str(value)[:40]}")
    value.encode()  # fails for lone surrogates
    return value
