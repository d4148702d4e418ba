"""The keys of the guide's moving picture, and a drive in which they are pressed on the real screen."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from textual.pilot import Pilot

from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.guide.cast.cast_frames import CastFrame, capture_frame
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map
from pdtui.tui.drive_app import DriveApp

SIZE = (88, 26)
SEED = 7
_PATIENCE = 60.0
_BETWEEN = 1.0
"""Time between two frames of a robot that moves, s."""
_READING = 1.6
"""Time for which a frame stays that shows what a key did, s."""


class CastScene(NamedTuple):
    """What is pressed, what the caption says of it, and what is waited for and shown after it.

    Attributes:
        keys: names of keys, as the pilot presses them.
        says: the caption.
        steps: control steps to show after the keys.
        until: what a snapshot has to be before anything is shown, given the one before the keys.
    """

    keys: tuple[str, ...]
    says: str
    steps: int = 0
    until: Callable[[DriveSnapshot, DriveSnapshot], bool] = lambda *_: True


SCENES = (
    CastScene((), "the Ant runs by its policy alone", 20),
    CastScene(
        ("ctrl+g",),
        "ctrl+g: a ghost, the twin without the behavior, will run beside it",
        until=lambda shot, _: shot.ghost is not None and shot.ghost.condition != "loading",
    ),
    CastScene(("j",), "j: latch 'drift left'; the ghost runs straight on", 80),
    CastScene(("space",), "space: clear everything", 10),
    CastScene(("ctrl+e",), "ctrl+e: the unit bench"),
    CastScene(("equals_sign", *"0:187", "enter"), "= 0:187: pick a hidden unit"),
    CastScene(
        ("equals_sign", *"-8", "enter"),
        "= −8: hold it; Δ is what that changes, compared with the ghost",
        60,
        until=lambda shot, _: bool(shot.held_units),
    ),
    CastScene(("ctrl+s", *"lean"), "ctrl+s: save it as a behavior of the map …"),
    CastScene(("enter", "y", "enter"), "… with a key of its own"),
    CastScene(("escape", "space"), "esc: back to the behaviors", 20),
    CastScene(
        ("less_than_sign",) * 3,
        "<<<: look back, three seconds",
        until=lambda shot, _: shot.past is not None and shot.past.present - shot.step >= 60,
    ),
    CastScene(
        ("ctrl+n",),
        "ctrl+n: branch off a new session from there",
        until=lambda shot, before: shot.past is None and shot.step >= before.step,
    ),
    CastScene(("d", "p"), "d, p: and go on with another key", 60),
)


@dataclass(frozen=True)
class PerformedCast:
    """What a performance left.

    Attributes:
        frames: what the screen showed.
        sessions: the first drive and its branch.
        map: the map with the behavior that was saved.
    """

    frames: tuple[CastFrame, ...]
    sessions: tuple[Path, Path]
    map: Path


async def perform_cast(folder: Path, *, faster: int = 0) -> PerformedCast:
    """Drive the Ant on the real screen, in a terminal that only the program sees, and press the keys.

    Args:
        folder: an empty folder for the sessions and the map.
        faster: how often the speed is doubled; for a test.
    """
    config = DriveConfig("ant", load_map(find_map("ant")), SEED, recording="cast.rrd")
    with chdir(folder):
        connection = DriveClient(config)
        try:
            connection.wait_until_started()
            app = DriveApp(connection, config.stimulation_map, fps=20)
            async with app.run_test(size=SIZE) as pilot:
                await _wait(pilot, app, lambda shot: shot.step > 20)
                frames: list[CastFrame] = []
                for number, scene in enumerate(SCENES):
                    frames += await _play(pilot, app, scene)
                    # Not before the ghost, while whose process is starting the drive goes on.
                    await pilot.press(*["full_stop"] * (faster if number == 1 else 0))
        finally:
            connection.close()
    (branch,) = folder.glob("cast-from-step-*.rrd")
    return PerformedCast(tuple(frames), (folder / "cast.rrd", branch), folder / "maps" / "ant.toml")


async def _play(pilot: Pilot[str], app: DriveApp, scene: CastScene) -> list[CastFrame]:
    before = app.snapshot
    assert before is not None
    await pilot.press(*scene.keys)
    await _wait(pilot, app, lambda shot: scene.until(shot, before), scene.says)
    await pilot.pause(0.15)
    begun = _step(app)
    frames = [capture_frame(app, scene.says, _READING)]
    every = max(1, round(_BETWEEN / (0.05 if app.facts is None else app.facts.dt)))
    for step in range(begun + every, begun + scene.steps + 1, every):
        await _wait(pilot, app, lambda shot, step=step: shot.step >= step, scene.says)  # type: ignore[misc]
        frames.append(capture_frame(app, scene.says, _BETWEEN))
    if len(frames) > 1:
        frames[0] = replace(frames[0], seconds=_BETWEEN)
    return frames


def _step(app: DriveApp) -> int:
    return 0 if app.snapshot is None else app.snapshot.step


async def _wait(
    pilot: Pilot[str], app: DriveApp, wanted: Callable[[DriveSnapshot], bool], said: str = "the start"
) -> None:
    deadline = time.monotonic() + _PATIENCE
    while app.snapshot is None or not wanted(app.snapshot):
        if time.monotonic() > deadline:
            raise TimeoutError(f"waited {_PATIENCE:g} s after '{said}'")
        await pilot.pause(0.02)
