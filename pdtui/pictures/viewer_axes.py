"""Axes with ticks in a 2D view of the viewer, which by itself draws none."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.pictures.plot_colors import RgbColor

Log = Callable[[str, Any], None]

WIDTH, HEIGHT = 560.0, 240.0
_MARGIN = (60.0, 30.0, 34.0, 56.0)
"""Room for labels, in the same measure: left, right, top, bottom."""
_TICK = 6.0
_LETTER, _LINE = 6.5, 18.0
"""Size of a letter where the view is as large as the frame; a label hangs below its point."""
_FILLED = 8
"""Lines that fill a bar."""
_INK, _FAINT = (160, 160, 160), (75, 75, 75)


@dataclass(frozen=True)
class ViewerAxis:
    """One axis.

    Attributes:
        label: what it measures, with its unit.
        low, high: ends.
        ticks: where to put which text.
    """

    label: str
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...]

    @classmethod
    def over(cls, label: str, values: Floats, margin: float = 0.0) -> ViewerAxis:
        """An axis from the lowest to the highest finite value, at round ticks.

        Args:
            label: what it measures.
            values: of any shape.
            margin: how much longer to make it at each end, in parts of the range.
        """
        known = values[np.isfinite(values)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
        if low == high:
            low, high = low - 1.0, high + 1.0
        low, high = low - margin * (high - low), high + margin * (high - low)
        return cls(label, low, high, tuple((tick, f"{tick:g}") for tick in round_ticks(low, high)))

    @classmethod
    def named(cls, label: str, names: Sequence[str]) -> ViewerAxis:
        """An axis of cells, each one wide, with a name in the middle of each."""
        return cls(label, 0.0, float(len(names)), tuple((i + 0.5, name) for i, name in enumerate(names)))


def round_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten inside a range, at most so many."""
    for exponent in range(math.floor(math.log10((high - low) / most)), 400):
        for factor in (1, 2, 5):
            step = factor * 10.0**exponent
            first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
            if last - first < most:
                return [float(f"{number * step:.12g}") for number in range(first, last + 1)]
    raise ValueError(f"no ticks between {low} and {high}")


class ViewerAxes:
    """A pair of axes; places what is drawn between them.

    Args:
        entity: parent of what is drawn.
        log: writes a part of the picture under an entity.
        x, y: to the right and up.
        width, height: of the frame.
    """

    def __init__(
        self,
        entity: str,
        log: Log,
        x: ViewerAxis,
        y: ViewerAxis,
        width: float = WIDTH,
        height: float = HEIGHT,
    ) -> None:
        self.entity, self._log = entity, log
        self._x, self._y, self._width, self._height = x, y, width, height

    def place(self, x: Floats, y: Floats) -> Floats:
        """Where points are in the view, shape (N, 2)."""
        right = (np.asarray(x, np.float64) - self._x.low) / (self._x.high - self._x.low)
        up = (np.asarray(y, np.float64) - self._y.low) / (self._y.high - self._y.low)
        return np.column_stack([right * self._width, (1 - up) * self._height])

    def draw(self) -> None:
        """Frame, ticks and labels."""
        w, h = self._width, self._height
        strips: list[Any] = [[(0, 0), (0, h), (w, h), (w, 0), (0, 0)]]
        texts, places = [], []
        ups = self.place(
            np.array([self._x.low] * len(self._y.ticks)), np.array([v for v, _ in self._y.ticks])
        )
        for (_, y), (_, text) in zip(ups, self._y.ticks, strict=True):
            strips.append([(-_TICK, y), (0, y)])
            texts.append(text)
            places.append((-2 * _TICK - _LETTER * len(text) / 2, y - _LINE / 2))
        rights = self.place(
            np.array([v for v, _ in self._x.ticks]), np.array([self._y.low] * len(self._x.ticks))
        )
        lines = self._lines()
        for number, ((x, _), (_, text)) in enumerate(zip(rights, self._x.ticks, strict=True)):
            down = h + _TICK + number % lines * _LINE
            strips.append([(x, h), (x, down)])
            texts.append(text)
            places.append((x, down))
        texts += [self._x.label, self._y.label]
        places += [(w / 2, h + _TICK + lines * _LINE + 4), (_LETTER * len(self._y.label) / 2, -1.6 * _LINE)]
        frame = rr.LineStrips2D(strips, colors=[_INK], radii=rr.Radius.ui_points(0.7))
        self._log(f"{self.entity}/axes/frame", frame)
        dots = rr.Radius.ui_points(0.0)
        labels = rr.Points2D(places, labels=texts, colors=[_INK], radii=dots, show_labels=True)
        self._log(f"{self.entity}/axes/labels", labels)

    def _lines(self) -> int:
        """How many lines the labels below take turns in, so that none covers its neighbour."""
        ticks = self._x.ticks
        if len(ticks) < 2:
            return 1
        apart = (ticks[1][0] - ticks[0][0]) / (self._x.high - self._x.low) * self._width
        return math.ceil((max(len(text) for _, text in ticks) + 1.5) * _LETTER / apart)

    def line(self, name: str, points: Floats, color: RgbColor) -> None:
        """A curve with a dot at each of its points, shape (N, 2) in the view."""
        self._log(
            f"{self.entity}/{name}/line",
            rr.LineStrips2D([points.tolist()], colors=[color], radii=rr.Radius.ui_points(1.2)),
        )
        self._log(
            f"{self.entity}/{name}/dots", rr.Points2D(points, colors=[color], radii=rr.Radius.ui_points(3.5))
        )

    def bars(self, name: str, x: Floats, lows: Floats, highs: Floats, color: RgbColor) -> None:
        """Upright bars with caps, as for intervals."""
        down, up = self.place(x, lows), self.place(x, highs)
        cap = np.array([4.0, 0.0])
        strips = []
        for low, high in zip(down, up, strict=True):
            strips += [[low, high], [low - cap, low + cap], [high - cap, high + cap]]
        if strips:
            whiskers = rr.LineStrips2D(strips, colors=[color], radii=rr.Radius.ui_points(0.8))
            self._log(f"{self.entity}/{name}/intervals", whiskers)

    def level(self, value: float) -> None:
        """A faint horizontal line."""
        ends = self.place(np.array([self._x.low, self._x.high]), np.array([value, value]))
        zero = rr.LineStrips2D([ends], colors=[_FAINT], radii=rr.Radius.ui_points(0.7))
        self._log(f"{self.entity}/axes/level_{value:g}", zero)

    def level_bars(self, name: str, y: Floats, lengths: Floats, colors: Sequence[RgbColor]) -> None:
        """Bars from 0 to the right, in cells of height 1.

        A box of the viewer is hollow and a thick line has round ends, which would lengthen a bar by its own
        thickness: each bar is filled with thin lines instead.
        """
        cell = self._height / (self._y.high - self._y.low)
        thin = 0.38 * cell / _FILLED
        down = np.linspace(thin - 0.38 * cell, 0.38 * cell - thin, _FILLED)
        bars = np.stack([self.place(np.zeros(len(y)), y), self.place(lengths, y)], axis=1)
        strips = bars[:, None] + np.stack([np.zeros(_FILLED), down], axis=1)[:, None]
        every = [color for color in colors for _ in range(_FILLED)]
        lines = rr.LineStrips2D(list(strips.reshape(-1, 2, 2)), colors=every, radii=thin)
        self._log(f"{self.entity}/{name}", lines)

    def heat_map(self, cells: Floats, low: float, high: float) -> None:
        """Values as colours, from top to bottom and left to right, shape (rows, columns)."""
        image = rr.DepthImage(
            cells.astype(np.float32), meter=1.0, colormap="viridis", depth_range=(low, high), draw_order=-10.0
        )
        self._picture(cells.shape, image)

    def picture(self, colors: NDArray[np.uint8]) -> None:
        """Cells of given colours, from top to bottom and left to right, shape (rows, columns, 3)."""
        self._picture(colors.shape, rr.Image(colors, color_model="RGB", draw_order=-10.0))

    def _picture(self, shape: tuple[int, ...], image: rr.DepthImage | rr.Image) -> None:
        scale = [self._width / shape[1], self._height / shape[0], 1.0]
        self._log(f"{self.entity}/picture", rr.Transform3D(scale=scale))
        self._log(f"{self.entity}/picture", image)


def axes_view(
    entity: str,
    name: str,
    width: float = WIDTH,
    height: float = HEIGHT,
    more: tuple[float, float] = (0.0, 0.0),
) -> rrb.Spatial2DView:
    """A view of what `ViewerAxes` drew under an entity.

    Args:
        entity: their parent.
        name: title.
        width, height: of the frame.
        more: room for longer labels, to the left and below.
    """
    left, right, top, bottom = _MARGIN
    left, bottom = left + more[0], bottom + more[1]
    bounds = rrb.VisualBounds2D(x_range=[-left, width + right], y_range=[-top, height + bottom])
    return rrb.Spatial2DView(origin=entity, name=name, visual_bounds=bounds)
