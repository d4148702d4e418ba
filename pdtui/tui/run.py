"""Runs the application from start to end, with a drive behind it that is always closed."""

from __future__ import annotations

from pdtui.stimulation.maps import StimulationMap
from pdtui.teleop.link import DriveLink
from pdtui.tui.app import DriveApp


def run_drive(link: DriveLink, stimulation_map: StimulationMap, *, watching: bool = False) -> str:
    """Drive in the terminal until the user quits; returns how the drive ended, in one line.

    The link is closed whatever happens.

    Raises:
        PdtuiError: what ended the simulation's process, or kept the recording from becoming whole.
    """
    app = DriveApp(link, stimulation_map, watching=watching)
    try:
        line = app.run()
    finally:
        closing = "" if app.closed else link.close()
    if app.failure is not None:
        raise app.failure
    return line or closing
