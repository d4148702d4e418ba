"""Pictures of a world in half blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.tui.widgets.world_picture import WorldPicture, fit_picture
from tests.tui.conftest import MakeApp
from tests.tui.screens import played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
async def test_a_world_without_links_shows_its_picture(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, snapshots = drive
    picture = np.full((60, 90, 3), 255, np.uint8)
    picture[:30] = (200, 0, 0)
    plain = replace(facts, links=(), pictured=True)
    bare = [replace(one, poses=np.empty((0, 7)), path=np.empty((0, 3))) for one in snapshots[:3]]
    app, connection = make_app([plain, bare[0]])
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        pane = app.query_one(WorldPicture)
        assert pane.display
        assert not app.query_one("#robot").display
        assert not app.query_one("#path").display
        assert app.query_one("#attributes").display
        assert "waiting for the picture" in shown(pane)
        connection.messages += [replace(bare[1], picture=picture), bare[2]]
        await played(pilot, connection)
        parts = [part for strip in pane.render_lines(pane.outer_size.region) for part in strip]
        colors = [part.style.color.triplet for part in parts if "▀" in part.text and part.style is not None]  # type: ignore[union-attr]
        assert colors[0] == (200, 8, 8)
        assert colors[-1] == (248, 248, 248)
        wide = max(len(part.text) for part in parts if "▀" in part.text)
        lines = sum("▀" in line for line in shown(pane).splitlines())
        assert abs(wide / (2 * lines) - 1.5) < 0.2


def test_a_picture_fits_and_keeps_its_shape() -> None:
    rows = np.arange(40, dtype=np.uint8).reshape(40, 1, 1)
    picture = np.broadcast_to(rows, (40, 60, 3))
    fitted = fit_picture(picture, 20, 100)
    assert fitted.shape == (20, 30, 3)
    assert (np.diff(fitted[:, 0, 0].astype(int)) == 2).all()
    assert fit_picture(picture, 100, 30).shape == (20, 30, 3)
    assert fit_picture(np.zeros((1, 500, 3), np.uint8), 10, 20).shape == (2, 20, 3)
