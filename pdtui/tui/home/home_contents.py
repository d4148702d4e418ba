"""What the home screen lists: robots, maps, recent sessions and reports."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pdtui.robots.robot_registry import ListedRobot, list_robots
from pdtui.sessions.session_folders import list_session_files
from pdtui.stimulation.map_library import ListedMap, list_maps, search_folders

MOST_SESSIONS = 12
"""How many sessions count as recent."""


@dataclass(frozen=True)
class HomeContents:
    """What there is to open.

    Attributes:
        robots: robots that can be driven, and those that something is missing for.
        maps: all maps, the user's own first.
        sessions: the newest sessions first.
        reports: reports of dissections.
    """

    robots: tuple[ListedRobot, ...]
    maps: tuple[ListedMap, ...]
    sessions: tuple[Path, ...] = ()
    reports: tuple[Path, ...] = ()

    def maps_of(self, robot: str) -> list[ListedMap]:
        """Return the maps of a robot."""
        return [
            one for one in self.maps if one.stimulation_map is not None and one.stimulation_map.robot == robot
        ]

    def starts_of(self, robot: str) -> tuple[str, ...]:
        """Return the states in which a robot can start, besides the usual one."""
        return next((one.starts for one in self.robots if one.name == robot), ())


def read_home_contents() -> HomeContents:
    """Look for everything that the home screen lists."""
    listed, maps = list_robots(), list_maps()
    named = {one.name for one in listed}
    found = [one.stimulation_map.robot for one in maps if one.stimulation_map is not None]
    # Environments of Gymnasium have no entry of their own, but a map makes one worth listing.
    others = [ListedRobot(name) for name in dict.fromkeys(found) if name not in named]
    reports = [path for folder in search_folders("maps") for path in sorted(folder.glob("*.rrd"))]
    return HomeContents(
        (*listed, *others), tuple(maps), tuple(list_session_files(MOST_SESSIONS)), tuple(reports)
    )
