"""Curves over time as an SVG picture, with the spans in which something was active behind them."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _GAP = 720, 54, 150, 70, 12
_POINTS = 700
"""More than these would not be told apart at this width; their least and largest values are drawn."""


class Curve(NamedTuple):
    """A series over time, with its name and unit."""

    name: str
    unit: str
    values: NDArray[np.float64]


class Span(NamedTuple):
    """A stretch of time, in s, with what was active in it and the color of that."""

    start: float
    end: float
    name: str
    color: str


def render_curves(seconds: float, curves: Sequence[Curve], spans: Sequence[Span] = ()) -> str:
    """Return curves that begin at 0 s and end at `seconds`, one below the other, as SVG."""
    height = len(curves) * (_HEIGHT + _GAP) + 2 * _GAP + 14
    width = _WIDTH - _LEFT - _RIGHT

    def across(time: float) -> float:
        return _LEFT + width * time / max(seconds, 1e-9)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" '
        f'height="{height}" font-family="sans-serif" font-size="11" fill="currentColor">'
    ]
    bottom = height - _GAP - 14
    for span in spans:
        wide = max(across(span.end) - across(span.start), 1.0)
        parts.append(
            f'<rect x="{across(span.start):.1f}" y="{_GAP}" width="{wide:.1f}" height="{bottom - _GAP}" '
            f'fill="{escape(span.color)}" fill-opacity="0.25"><title>{escape(span.name)}</title></rect>'
        )
    for number, curve in enumerate(curves):
        parts += _draw_curve(curve, _GAP + number * (_HEIGHT + _GAP), width)
    parts.append(f'<text x="{_LEFT}" y="{height - 6}">0 s</text>')
    parts.append(f'<text x="{_LEFT + width}" y="{height - 6}" text-anchor="end">{seconds:g} s</text></svg>')
    return "".join(parts)


def _draw_curve(curve: Curve, top: float, width: float) -> list[str]:
    finite = curve.values[np.isfinite(curve.values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    x, y = _thin_out(curve.values)
    scale = (y - low) / (high - low) if high > low else np.where(np.isfinite(y), 0.5, np.nan)
    points = " ".join(
        f"{_LEFT + width * across:.1f},{top + _HEIGHT * (1.0 - up):.1f}"
        for across, up in zip(x, scale, strict=True)
        if np.isfinite(up)
    )
    name = f"{curve.name} ({curve.unit})" if curve.unit else curve.name
    end = _LEFT + width + 6
    return [
        f'<text x="{_LEFT - 8}" y="{top + _HEIGHT / 2 + 4:.0f}" text-anchor="end">{escape(name)}</text>',
        f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1"/>',
        f'<text x="{end}" y="{top + 9}" fill-opacity="0.7">{high:.3g}</text>',
        f'<text x="{end}" y="{top + _HEIGHT}" fill-opacity="0.7">{low:.3g}</text>',
    ]


def _thin_out(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places from 0 to 1 and values; of a long series, the extremes of each of its pieces."""
    count = len(values)
    places = np.linspace(0.0, 1.0, count) if count > 1 else np.zeros(count)
    if count <= _POINTS:
        return places, values
    kept = np.unique(
        [
            begin + index
            for begin, piece in zip(
                np.linspace(0, count, _POINTS // 2, endpoint=False).astype(int),
                np.array_split(np.nan_to_num(values), _POINTS // 2),
                strict=True,
            )
            for index in (int(piece.argmin()), int(piece.argmax()))
        ]
    )
    kept = kept[kept < count]
    return places[kept], values[kept]
