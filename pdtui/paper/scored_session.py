"""Drives that an experiment scores: recorded like a person's, and read back with what a score needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from pdtui.core.atomic_file import write_file
from pdtui.core.attributes import Floats, attribute_column
from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.keystrokes import format_keystrokes
from pdtui.sessions.session_reader import Session, read_session
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.writer.session_recorder import SessionRecorder

Score = TypeVar("Score")


def record_scored_drive(
    loop: ControlLoop,
    path: Path,
    activations: ActivationsKept,
    drive: Callable[[SessionRecorder], tuple[Score, Sequence[DriveEvent]]],
) -> Score:
    """Record a drive, write its keys to a keystroke file beside the session, and return its score.

    Args:
        loop: The drive, before its first step.
        path: The session's file.
        activations: How much of the hidden units is kept.
        drive: Drives, writes each step to the recorder, and returns score and events.

    Raises:
        SessionError: A file already exists, or cannot be written.
    """
    with SessionRecorder(path, replace(loop.info, activations=activations)) as recorder:
        score, events = drive(recorder)
    write_file(path.with_suffix(".keys"), format_keystrokes(events), SessionError)
    return score


def read_scored_session(
    path: Path, robot: str, starts: Sequence[str], attributes: Sequence[str] = ()
) -> Session:
    """Read a session that is to be scored.

    Args:
        path: Its file.
        robot: The robot that it has to be of.
        starts: The starts that it may have, in their order.
        attributes: Names of attributes that the score needs.

    Raises:
        SessionError: The session cannot be read, is of another robot or start, has no steps, lacks an
            attribute, or was rewound.
    """
    session = read_session(path)
    info = session.info
    if info.robot != robot or info.start not in starts:
        found = f"start '{info.start}'" if info.start else "the usual start"
        wanted = f"start '{starts[0]}'"
        if len(starts) > 1:
            wanted = f"a start from '{starts[0]}' to '{starts[-1]}'"
        raise SessionError(
            f"{path}: expected a drive of {robot} with {wanted}, found one of {info.robot} with {found}"
        )
    back = next((event.step for event in session.events if event.kind == "rewind"), None)
    if back is not None:
        raise SessionError(f"{path}: it was rewound at step {back}; a scored drive must not be rewound")
    if not session.steps:
        raise SessionError(f"{path}: the session has no steps")
    names = [attribute.name for attribute in info.attributes]
    for name in attributes:
        if name not in names:
            raise SessionError(f"{path}: expected the attribute '{name}'; available: {', '.join(names)}")
    return session


def read_attribute(session: Session, name: str) -> Floats:
    """Return an attribute after each step of a session, in its own unit, shape (T,)."""
    return session.attributes[:, attribute_column(name, session.info.attributes, session.info.robot)]
