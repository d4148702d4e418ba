"""Writes the frames of a cast as one moving SVG picture, which needs no script and no font of its own.

A line that several frames share is stored once. Blocks and Braille letters are drawn, because the fonts of a
browser would give them other widths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import accumulate, groupby
from typing import NamedTuple, TypeVar
from xml.sax.saxutils import escape

from pdtui.guide.cast.cast_frames import CastFrame, ScreenCell

Shared = TypeVar("Shared")
_WIDE, _HIGH = 8, 16  # of a cell, px
_DOTS = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]
"""Column and row of each bit of a Braille letter."""
_BLOCKS = " ▁▂▃▄▅▆▇█"


class _Stroke(NamedTuple):
    middle: int
    x: int
    length: int


class CastPicture:
    """Collects what the frames share, and composes the picture.

    Args:
        frames: the frames, all of one size.
        background: color of the screen's background.
        title: what the picture shows, for those who cannot see it.
    """

    def __init__(self, frames: Sequence[CastFrame], background: str, title: str) -> None:
        self._frames, self._background, self._title = frames, background, title
        self._colors: dict[str, str] = {}
        self._lines: dict[tuple[int, tuple[ScreenCell, ...]], str] = {}
        self._parts: list[str] = []

    def compose(self) -> str:
        """Return the SVG document."""
        width = _WIDE * max(len(line) for line in self._frames[0].lines)
        height = _HIGH * (len(self._frames[0].lines) + 2)
        shown = [self._compose_frame(number, frame) for number, frame in enumerate(self._frames)]
        return "".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img">',
                f"<title>{escape(self._title)}</title><style>",
                "text{font:13px monospace;white-space:pre}path{fill:none}.b{font-weight:bold}",
                *self._color_rules(),
                *self._time_rules(),
                f'</style><rect width="100%" height="100%" fill="{self._background}"/>',
                "<defs>",
                *self._parts,
                "</defs>",
                *shown,
                "</svg>\n",
            ]
        )

    def _compose_frame(self, number: int, frame: CastFrame) -> str:
        used = [self._line(row, line) for row, line in enumerate(frame.lines)]
        caption = (
            f'<text class="c" x="8" y="{_HIGH * (len(frame.lines) + 1) + 8}">{escape(frame.caption)}</text>'
        )
        uses = "".join(f'<use href="#{name}"/>' for name in used if name)
        return f'<g id="f{number}">{uses}{caption}</g>'

    def _time_rules(self) -> Iterator[str]:
        """Yield rules that show each frame in its time, one after the other, for ever."""
        ends = list(accumulate(frame.seconds for frame in self._frames))
        yield ".c{fill:#f0a45d;font-weight:bold}"
        for number, end in enumerate(ends):
            start, stop = (100 * at / ends[-1] for at in (end - self._frames[number].seconds, end))
            yield f"#f{number}{{animation:k{number} {ends[-1]:.1f}s step-end infinite}}"
            before = f"0%{{visibility:hidden}}{start:.2f}%" if number else "0%"
            yield f"@keyframes k{number}{{{before}{{visibility:visible}}{stop:.2f}%{{visibility:hidden}}}}"

    def _color_rules(self) -> Iterator[str]:
        for color, name in self._colors.items():
            yield f".{name}{{fill:{color}}}path.{name}{{stroke:{color};fill:none}}"

    def _color(self, color: str) -> str:
        return self._colors.setdefault(color, f"s{len(self._colors)}")

    def _line(self, row: int, cells: tuple[ScreenCell, ...]) -> str:
        """Return the name of a line, which is stored with the first frame that has it; empty for a blank."""
        if (row, cells) not in self._lines:
            drawn = "".join(self._draw_line(row, cells))
            name = f"l{len(self._lines)}" if drawn else ""
            self._lines[row, cells] = name
            if drawn:
                self._parts.append(f'<g id="{name}">{drawn}</g>')
        return self._lines[row, cells]

    def _draw_line(self, row: int, cells: Sequence[ScreenCell]) -> Iterator[str]:
        y = row * _HIGH
        strokes: dict[tuple[str, int], list[_Stroke]] = {}

        def stroke(color: str, thick: int, x: int, middle: int, length: int) -> None:
            if color != self._background:
                strokes.setdefault((color, thick), []).append(_Stroke(middle, x, length))

        for (color, is_block), run in _runs(cells, lambda cell: (cell.back, cell.letter == "▀")):
            if not is_block:
                stroke(color, _HIGH, run[0] * _WIDE, y + _HIGH // 2, len(run) * _WIDE)
        for (upper, lower), run in _runs(cells, lambda cell: (cell.front, cell.back)):
            halves = [column for column in run if cells[column].letter == "▀"]
            for left, count in _stretches(halves):
                stroke(upper, _HIGH // 2, left * _WIDE, y + _HIGH // 4, count * _WIDE)
                stroke(lower, _HIGH // 2, left * _WIDE, y + 3 * _HIGH // 4, count * _WIDE)
        for column, cell in enumerate(cells):
            code = ord(cell.letter)
            if 0x2800 < code < 0x2900:
                for bit, (across, down) in enumerate(_DOTS):
                    if code - 0x2800 >> bit & 1:
                        stroke(cell.front, 2, column * _WIDE + 1 + 4 * across, y + 2 + 4 * down, 2)
            elif cell.letter == "│":
                stroke(cell.front, _HIGH, column * _WIDE + 4, y + _HIGH // 2, 1)
            elif cell.letter in _BLOCKS[1:]:
                high = 2 * _BLOCKS.index(cell.letter)
                stroke(cell.front, high, column * _WIDE, y + _HIGH - high // 2, _WIDE)
        for (color, thick), found in strokes.items():
            yield f'<path class="{self._color(color)}" stroke-width="{thick}" d="{_join_strokes(found)}"/>'
        yield from self._draw_text(y, cells)

    def _draw_text(self, y: int, cells: Sequence[ScreenCell]) -> Iterator[str]:
        for (color, bold), run in _runs(cells, lambda cell: (cell.front, cell.bold)):
            written = [column for column in run if not _is_drawn(cells[column].letter)]
            for left, count in _stretches(written):
                text = "".join(cells[column].letter for column in range(left, left + count))
                begin = len(text) - len(text.lstrip())
                if not (text := text.strip()):
                    continue
                names = f"{self._color(color)} b" if bold else self._color(color)
                x, length = (left + begin) * _WIDE, len(text) * _WIDE
                where = f'x="{x}" y="{y + 12}"' + (f' textLength="{length}"' if len(text) > 1 else "")
                yield f'<text class="{names}" {where}>{escape(text)}</text>'


def _is_drawn(letter: str) -> bool:
    return letter in "▀│" or letter in _BLOCKS[1:] or 0x2800 <= ord(letter) < 0x2900


def _join_strokes(strokes: list[_Stroke]) -> str:
    """Return the moves of a path that draws horizontal strokes, those that touch as one."""
    joined: list[_Stroke] = []
    for one in sorted(strokes):
        last = joined[-1] if joined else _Stroke(-1, -1, 0)
        if (last.middle, last.x + last.length) == (one.middle, one.x):
            joined[-1] = last._replace(length=last.length + one.length)
        else:
            joined.append(one)
    moves, at = [], (0, 0)
    for one in joined:
        moves.append(f"m{one.x - at[0]} {one.middle - at[1]}h{one.length}".replace(" -", "-"))
        at = one.x + one.length, one.middle
    return "".join(moves)


def _runs(
    cells: Sequence[ScreenCell], key: Callable[[ScreenCell], Shared]
) -> Iterator[tuple[Shared, list[int]]]:
    """Yield stretches of cells that are alike, as what they share and their columns."""
    for shared, run in groupby(range(len(cells)), lambda column: key(cells[column])):
        yield shared, list(run)


def _stretches(columns: Iterable[int]) -> Iterator[tuple[int, int]]:
    """Yield the first column and the number of columns of each stretch without a gap."""
    for _, run in groupby(enumerate(columns), lambda pair: pair[1] - pair[0]):
        stretch = [column for _, column in run]
        yield stretch[0], len(stretch)
