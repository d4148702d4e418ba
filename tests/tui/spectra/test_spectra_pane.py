"""The pane of spectrograms: what it asks for, and what it draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.live_spectra.spectra_snapshot import RankedUnit, SpectraChoice, SpectraSnapshot
from pdtui.tui.spectra.spectra_pane import SpectraPane
from tests.tui.conftest import MakeApp
from tests.tui.screens import played, shown

Drive = tuple[DriveFacts, list[DriveSnapshot]]


def spectra_of(choice: SpectraChoice) -> SpectraSnapshot:
    """A spectrogram that is strong at low frequencies, and a unit's at high ones."""
    power = np.tile(np.linspace(1.0, 0.0, 33) ** 4, (12, 1))
    ranking = (RankedUnit(5, 0.25), RankedUnit(259, 0.5), RankedUnit(7, 1.5))
    unit = choice.unit if choice.unit >= 0 else 5
    return SpectraSnapshot(
        *(choice, "", 300, 240, unit, np.linspace(0, 10, 33), power, power[:, ::-1], ranking, 0.25)
    )


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
async def test_keys_and_clicks_choose_what_is_drawn(
    make_app: MakeApp, drive: Drive, size: tuple[int, int]
) -> None:
    facts, snapshots = drive
    names = [attribute.name for attribute in facts.attributes]
    app, connection = make_app(3)
    async with app.run_test(size=size) as pilot:
        await played(pilot, connection)
        pane = app.query_one(SpectraPane)
        assert not pane.display
        await pilot.press("f3", "f4")
        assert connection.spectra == []
        await pilot.press("ctrl+f")
        await pilot.pause()
        first = SpectraChoice(names.index("yaw rate"))
        assert connection.spectra == [first]
        assert "computing" in shown(pane)
        connection.messages.append(replace(snapshots[3], spectra=SpectraSnapshot(first, "40 of the 64")))
        await played(pilot, connection)
        assert "40 of the 64" in shown(pane)
        connection.messages.append(replace(snapshots[4], spectra=spectra_of(first)))
        await played(pilot, connection)
        text = shown(pane)
        assert all(
            part in text for part in ("yaw rate", "last 12 s", "unit 0:5", "discrepancy 0.25", "10 Hz")
        )
        assert "1:3" in text or size == (80, 24)
        await pilot.press("f4")
        assert connection.spectra[-1] == SpectraChoice(first.attribute, 259)
        connection.messages.append(replace(snapshots[5], spectra=spectra_of(connection.spectra[-1])))
        await played(pilot, connection)
        assert "unit 1:3" in shown(pane)
        row = next(row for row, line in enumerate(shown(pane).splitlines()) if "  1 0:5" in line)
        column = shown(pane).splitlines()[row].index("  1 0:5")
        await pilot.click(pane, offset=(column + 4, row))
        assert connection.spectra[-1] == SpectraChoice(first.attribute, 5)
        await pilot.press("f3")
        assert connection.spectra[-1] == SpectraChoice(first.attribute + 1)
        await pilot.press("ctrl+f")
        assert connection.spectra[-1] is None
        await pilot.pause()
        assert not pane.display
        assert app.query_one("#robot").display


async def test_low_frequencies_are_at_the_bottom(make_app: MakeApp, drive: Drive) -> None:
    facts, snapshots = drive
    choice = SpectraChoice([attribute.name for attribute in facts.attributes].index("yaw rate"))
    app, connection = make_app([facts, snapshots[0]])
    async with app.run_test(size=(120, 40)) as pilot:
        await played(pilot, connection)
        await pilot.press("ctrl+f")
        connection.messages.append(replace(snapshots[1], spectra=spectra_of(choice)))
        await played(pilot, connection)
        pane = app.query_one(SpectraPane)
        strips = pane.render_lines(pane.outer_size.region)
        lines = [[part for part in strip if "▀" in part.text] for strip in strips]
        drawn = [line[0].style.color.triplet for line in lines if line and line[0].style is not None]  # type: ignore[union-attr]
        warmth = [triplet.red - triplet.blue for triplet in drawn if triplet is not None]
        half = len(warmth) // 2
        assert warmth[0] < warmth[half - 1]
        assert warmth[half] > warmth[-1]
