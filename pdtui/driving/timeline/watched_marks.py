"""What a recording that is watched is known to bring: its keys, and the ends of its episodes."""

from __future__ import annotations

from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import EpisodeEnd, KeyPress


def list_watched_marks(config: DriveConfig) -> tuple[tuple[KeyPress, ...], tuple[EpisodeEnd, ...]]:
    """Return the key presses and the ends of episodes of the session that a drive follows, if it does."""
    session = config.watched
    if session is None:
        return (), ()
    rows = {name: row for row, name in enumerate(config.stimulation_map.behaviors)}
    keys = tuple(
        KeyPress(event.step, event.key, rows.get(event.name, -1) if event.kind == "behavior" else -1)
        for event in session.events
        if event.key
    )
    return keys, tuple(EpisodeEnd(step, outcome) for step, outcome in sorted(session.outcomes.items()))
