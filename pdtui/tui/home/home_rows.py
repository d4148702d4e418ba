"""The rows of the home screen, and of the lists that its rows open."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from pdtui.core.errors import SessionError
from pdtui.sessions.session_header import read_session_header
from pdtui.tui.home.home_contents import HomeContents

Opens = Literal["robot", "map", "session", "drive", "watch", "viewer", "guide"]
_USUAL = "the usual start"


@dataclass(frozen=True)
class HomeRow:
    """One row.

    Attributes:
        section: heading under which it stands; empty if there is only one.
        name: what it stands for.
        says: what is to be known of it.
        opens: what choosing it opens: another list (of a robot, a map or a session), or what the application
            is closed for.
        path: file of the map, the session or the report.
        robot: name of the robot.
        start: name of the start; empty for the usual one.
        problem: why it cannot be chosen; empty if it can.
    """

    section: str
    name: str
    says: str
    opens: Opens
    path: str = ""
    robot: str = ""
    start: str = ""
    problem: str = ""


def list_home_rows(contents: HomeContents) -> Iterator[HomeRow]:
    """Yield the rows of the first list."""
    for robot in contents.robots:
        maps = contents.maps_of(robot.name)
        problem = robot.problem or ("" if maps else f"no map yet: pdtui dissect {robot.name}")
        counted = _count(len(maps), "map") + (
            f", {_count(len(robot.starts), 'start')}" if robot.starts else ""
        )
        says = f"{robot.title or robot.name} · {counted}"
        yield HomeRow("robots", robot.name, says, "robot", robot=robot.name, problem=problem)
    for one in contents.maps:
        if one.stimulation_map is None:
            yield HomeRow("broken maps", one.path.stem, "", "map", str(one.path), problem=one.problem)
    for path in contents.sessions:
        yield HomeRow("recent sessions", path.stem, _describe_file(path), "session", str(path))
    for path in contents.reports:
        yield HomeRow("reports", path.stem, f"{_describe_file(path)} · {path}", "viewer", str(path))
    yield HomeRow("help", "guide", "how to drive, dissect and evaluate", "guide")


def list_robot_rows(contents: HomeContents, robot: str) -> Iterator[HomeRow]:
    """Yield a row for each map of a robot."""
    for one in contents.maps_of(robot):
        assert one.stimulation_map is not None
        starts = contents.starts_of(robot)
        counted = _count(len(one.stimulation_map.behaviors), "behavior")
        says = f"{counted} · policy {one.stimulation_map.policy} · {one.path}"
        yield HomeRow("", one.path.stem, says, "map" if starts else "drive", str(one.path), robot)


def list_start_rows(contents: HomeContents, chosen: HomeRow) -> Iterator[HomeRow]:
    """Yield a row for each state in which a drive with a map can start."""
    yield HomeRow("", _USUAL, "", "drive", chosen.path, chosen.robot)
    for start in contents.starts_of(chosen.robot):
        yield HomeRow("", start, "", "drive", chosen.path, chosen.robot, start)


def list_session_rows(path: str) -> Iterator[HomeRow]:
    """Yield what can be done with a session; of a broken one, what is wrong with it."""
    try:
        header = read_session_header(Path(path))
    except SessionError as error:
        yield HomeRow("", "broken", "", "watch", path, problem=str(error))
        return
    length = f"{header.steps} steps ({header.seconds:g} s), {_count(header.keys, 'key')}"
    told = f"{header.info.robot}, seed {header.info.seed} · {length}"
    nothing = "" if header.steps else "no control step is recorded"
    yield HomeRow(told, "watch", "repeats the drive on the screen", "watch", path, problem=nothing)
    yield HomeRow(told, "viewer", "opens it in the Rerun viewer", "viewer", path)


def _count(number: int, noun: str) -> str:
    return f"1 {noun}" if number == 1 else f"{number} {noun}s"


def _describe_file(path: Path) -> str:
    try:
        status = path.stat()
    except OSError as error:
        return str(error.strerror)
    return f"{datetime.fromtimestamp(status.st_mtime):%Y-%m-%d %H:%M} · {status.st_size / 1e6:.1f} MB"
