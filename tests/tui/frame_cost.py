"""What a frame of the screen costs: `python -m tests.tui.frame_cost`.

The recorded drive of these tests is drawn at 160×48 cells, as fast as it goes: widgets painted, what changed
composed, and the terminal's sequences written into a text. Nothing else runs, so the quickest tenth of the
frames depends little, and the number of calls not at all, on what else the machine does.
"""

from __future__ import annotations

import asyncio
import cProfile
import pstats
import time

import numpy as np
from textual._compositor import ChopsUpdate

from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.tui.drive_app import DriveApp
from pdtui.tui.snapshot_widget import SnapshotWidget
from tests.tui.conftest import DATA, ScriptedConnection
from tests.tui.recorded_snapshots import drive_map, load

SIZE = (160, 48)
_ROUNDS = 3


async def measure_frames() -> tuple[list[float], float]:
    """Return the processor's time of each frame, ms, and the calls of functions per frame."""
    facts, snapshots = load(DATA)
    app = DriveApp(ScriptedConnection([facts, *snapshots[:2]]), drive_map(), fps=50)
    async with app.run_test(size=SIZE) as pilot:
        await pilot.pause(1.0)
        widgets = {one for one in app.query("*") if isinstance(one, SnapshotWidget)}

        def draw(snapshot: DriveSnapshot) -> float:
            began = time.process_time()
            app.snapshot = snapshot
            compositor = app.screen._compositor
            compositor.update_widgets({one for one in widgets if one._repaint_regions})
            update = compositor.render_update()
            assert isinstance(update, ChopsUpdate)
            assert update.render_segments(app.console)
            return (time.process_time() - began) * 1000

        spent = [draw(snapshot) for snapshot in snapshots * _ROUNDS]
        with cProfile.Profile() as profile:
            for snapshot in snapshots:
                draw(snapshot)
    return spent, vars(pstats.Stats(profile))["total_calls"] / len(snapshots)


if __name__ == "__main__":
    frames, calls = asyncio.run(measure_frames())
    quick, median = np.percentile(frames, [10.0, 50.0])
    print(
        f"{len(frames)} frames: {quick:.1f} ms each in the quickest tenth, {median:.1f} ms in the median; "
        f"{calls:.0f} calls"
    )
