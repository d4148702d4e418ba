"""Where sessions are: the user's own, and the samples that come with pdtui."""

from __future__ import annotations

from pathlib import Path

from pdtui.core.settings.settings_file import own_folder
from pdtui.stimulation.map_library import shipped_folder


def list_session_files(most: int) -> list[Path]:
    """Return at most so many of the user's sessions, the newest first."""
    return sorted(own_folder("sessions").rglob("*.rrd"), key=_changed, reverse=True)[:most]


def list_sample_sessions() -> list[Path]:
    """Return the sessions that come with pdtui."""
    return sorted((shipped_folder("sessions") / "samples").glob("*.rrd"))


def _changed(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0  # it was removed in the meantime
