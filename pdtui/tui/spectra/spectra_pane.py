"""The pane of spectrograms: an attribute above a unit, and the units that are nearest to the attribute."""

from __future__ import annotations

from itertools import pairwise
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from pdtui.core.printable_text import make_printable
from pdtui.core.units import format_unit
from pdtui.driving.live_spectra.spectra_snapshot import SpectraChoice, SpectraSnapshot
from pdtui.tui.cell_text import ScreenRow, format_number
from pdtui.tui.snapshot_widget import SnapshotWidget
from pdtui.tui.theme import HEAT_LEVELS, STYLES

if TYPE_CHECKING:
    from textual import events

    from pdtui.core.attributes import Floats
    from pdtui.driving.drive_client import DriveConnection
    from pdtui.driving.drive_snapshot import DriveFacts
    from pdtui.stimulation.stimulation_map import StimulationMap

_RANGE = 4.0  # of power that is told apart, in powers of ten below the largest
_LABEL = 6  # width of the frequencies, cells
_RANKED = 19  # width of the ranked units, cells, where they are beside the pictures
_LEAST_WIDE = 52  # cells from which they are


class SpectraPane(SnapshotWidget):
    """Draws both spectrograms on one scale: time runs right, frequency up, and brighter is stronger.

    A click on a ranked unit chooses it.
    """

    BORDER_TITLE = "spectrograms"

    def __init__(
        self, stimulation_map: StimulationMap, connection: DriveConnection, *, id: str | None = None
    ) -> None:
        super().__init__(stimulation_map, id=id)
        self._connection = connection
        self._choice: SpectraChoice | None = None
        self._rows: dict[int, int] = {}
        """Unit that is ranked in each line of the pane."""

    def watch_facts(self, old: DriveFacts | None, facts: DriveFacts | None) -> None:
        super().watch_facts(old, facts)
        if old is not None and facts is not None and old.branches != facts.branches:
            self._connection.choose_spectra(self._choice)

    @property
    def is_open(self) -> bool:
        """Whether the pane is shown."""
        return self._choice is not None

    def leave(self) -> None:
        """Close the pane."""
        self._choose(None)

    def handle_request(self, request: str) -> None:
        """Open or close the pane, or go to the next attribute, or to the next of the ranked units."""
        count = 0 if self.facts is None else len(self.facts.attributes)
        if not count:
            return
        if request == "open":
            self._choose(SpectraChoice(self._usual_attribute()) if self._choice is None else None)
        elif self._choice is not None and request == "attribute":
            self._choose(SpectraChoice((self._choice.attribute + 1) % count))
        elif self._choice is not None and request == "unit":
            ranking = [ranked.unit for ranked in self._spectra.ranking] if self._spectra is not None else []
            if ranking:
                shown = self._spectra.unit if self._spectra is not None else -1
                place = ranking.index(shown) + 1 if shown in ranking else 0
                self._choose(SpectraChoice(self._choice.attribute, ranking[place % len(ranking)]))

    def _usual_attribute(self) -> int:
        """Return the attribute that the map's first primitive or aim is about, else the first."""
        assert self.facts is not None
        names = [attribute.name for attribute in self.facts.attributes]
        aims = [behavior.aim for behavior in self.map.behaviors.values()]
        wanted = [primitive.attribute for primitive in self.map.primitives.values()]
        wanted += [aim.attribute for aim in aims if aim is not None]
        return next((names.index(name) for name in wanted if name in names), 0)

    def _choose(self, choice: SpectraChoice | None) -> None:
        self._choice = choice
        self._connection.choose_spectra(choice)
        self.screen.set_class(choice is not None, "-spectra")
        self.redraw()

    @property
    def _spectra(self) -> SpectraSnapshot | None:
        """The spectrograms of what was chosen, once they have come."""
        spectra = None if self.snapshot is None else self.snapshot.spectra
        return spectra if spectra is not None and spectra.choice == self._choice else None

    def on_click(self, event: events.Click) -> None:
        """Choose the unit of the line."""
        unit = self._rows.get(event.y - self.gutter.top)
        if unit is not None and self._choice is not None:
            self._choose(SpectraChoice(self._choice.attribute, unit))

    def paint(self, width: int, height: int) -> list[Strip]:
        self._rows = {}
        if self.facts is None or self._choice is None:
            return []
        attribute = self.facts.attributes[self._choice.attribute]
        spectra, name = self._spectra, make_printable(attribute.name)
        if spectra is None or spectra.attribute_power is None or spectra.unit_power is None:
            said = "computing the spectrograms" if spectra is None else spectra.message
            return [
                ScreenRow(width).add(name, STYLES.title).strip(),
                *(ScreenRow(width).add(line, STYLES.muted).strip() for line in wrap(said, width)),
            ]
        beside = width >= _LEAST_WIDE
        listed = max(0, min(len(spectra.ranking), height - 1 if beside else max(1, height // 4)))
        room = height - 2 if beside else height - 2 - listed
        wide = width - _RANKED if beside else width
        each = max(1, room // 2)
        unit = f"unit {format_unit(spectra.unit, self.facts.layers)}"
        ranked = self._list_units(spectra, listed, _RANKED if beside else width)
        lines = [
            ScreenRow(wide).add(name, STYLES.title).add(self._describe_span(spectra), STYLES.faint),
            *self._draw(spectra.attribute_power, spectra, wide, each),
            ScreenRow(wide)
            .add(unit, STYLES.title)
            .add(f"  discrepancy {format_number(spectra.discrepancy)}", STYLES.muted),
            *self._draw(spectra.unit_power, spectra, wide, each),
        ]
        if not beside:
            first = len(lines)
            self._rows = {first + row: spectra.ranking[row].unit for row in range(listed)}
            return [line.strip() for line in (*lines, *ranked)]
        self._rows = {row + 1: spectra.ranking[row].unit for row in range(listed)}
        heading = ScreenRow(_RANKED).add("  nearest units", STYLES.muted)
        right = [heading, *ranked]
        right += [ScreenRow(_RANKED) for _ in range(len(lines) - len(right))]
        return [
            Strip([*line.strip(), *other.strip()], width) for line, other in zip(lines, right, strict=False)
        ]

    def _describe_span(self, spectra: SpectraSnapshot) -> str:
        assert self.facts is not None
        return f"  last {spectra.steps * self.facts.dt:.0f} s"

    def _list_units(self, spectra: SpectraSnapshot, count: int, width: int) -> list[ScreenRow]:
        assert self.facts is not None
        rows = []
        for place, ranked in enumerate(spectra.ranking[:count], start=1):
            shown = ranked.unit == spectra.unit
            row = ScreenRow(width).add(f"{place:>3} ", STYLES.faint)
            address = format_unit(ranked.unit, self.facts.layers)
            row.add(address, STYLES.accent if shown else STYLES.text, 7)
            rows.append(row.add(format_number(ranked.discrepancy), STYLES.muted, 8, right=True))
        return rows

    def _draw(self, power: Floats, spectra: SpectraSnapshot, width: int, height: int) -> list[ScreenRow]:
        """Return a spectrogram (D, F) as lines of two rows of pixels each, with its frequencies."""
        assert spectra.attribute_power is not None
        assert spectra.unit_power is not None
        assert spectra.frequencies is not None
        largest = max(float(spectra.attribute_power.max()), float(spectra.unit_power.max()), 1e-12)
        with np.errstate(divide="ignore"):
            share = np.clip(1.0 + np.log10(power / largest) / _RANGE, 0.0, 1.0)
        levels = np.round(share * HEAT_LEVELS).astype(np.int64) + HEAT_LEVELS
        windows, bins = levels.shape
        cells = max(1, width - _LABEL - 1)
        across = np.arange(cells) * windows // cells
        up = np.minimum(bins - 1, (np.arange(2 * height) * bins) // (2 * height))[::-1]
        pixels = levels[across][:, up].T
        highest = f"{spectra.frequencies[-1]:.0f} Hz"
        rows = []
        for line in range(height):
            label = highest if line == 0 else "0" if line == height - 1 else ""
            row = ScreenRow(width).add(label + " ", STYLES.faint, _LABEL, right=True)
            rows.append(row.add_strip(_pixel_line(pixels[2 * line], pixels[2 * line + 1])))
        return rows


def _pixel_line(upper: NDArray[np.int64], lower: NDArray[np.int64]) -> Strip:
    pairs = upper * 100 + lower
    cuts = [0, *(np.flatnonzero(pairs[1:] != pairs[:-1]) + 1).tolist(), len(pairs)]
    segments = []
    for a, b in pairwise(cuts):
        top, bottom = STYLES.heat[int(upper[a])], STYLES.heat[int(lower[a])]
        segments.append(Segment("▀" * (b - a), Style(color=top.rich_color, bgcolor=bottom.rich_color)))
    return Strip(segments, len(pairs))
