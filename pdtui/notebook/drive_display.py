"""What a notebook shows of a drive."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from pdtui.core.attributes import Attribute, Floats
from pdtui.notebook.curves import Curve, Span, render_curves

_MOST_CURVES = 8


def drive_html(
    title: str,
    dt: float,
    attributes: Sequence[Attribute],
    values: Floats,
    behaviors: Sequence[Sequence[str]],
    colors: Sequence[str],
) -> str:
    """Return the first attributes of a drive as curves, on the spans of the behaviors that were active.

    Args:
        title: one line on the drive.
        dt: simulated time of a control step, s.
        attributes: the attributes, in their order.
        values: their values, shape (S, J).
        behaviors: names of the behaviors active in each step.
        colors: a color for each behavior, in the order in which they were first active, over and over.
    """
    from html import escape

    curves = [
        Curve(attribute.name, attribute.unit, np.asarray(values[:, column], np.float64))
        for column, attribute in enumerate(attributes[:_MOST_CURVES])
    ]
    spans, chosen, step = list[Span](), dict[str, str](), 0
    for names, group in groupby(tuple(one) for one in behaviors):
        length = len(list(group))
        for name in names:
            color = chosen.setdefault(name, colors[len(chosen) % len(colors)])
            spans.append(Span(step * dt, (step + length) * dt, name, color))
        step += length
    legend = " ".join(
        f'<span style="border-left:0.8em solid {color}; padding-left:0.3em; margin-right:1em">'
        f"{escape(name)}</span>"
        for name, color in chosen.items()
    )
    return f"<p>{escape(title)}</p><p>{legend}</p>{render_curves(len(values) * dt, curves, spans)}"
