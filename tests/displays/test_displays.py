"""Tables that can be sorted, curves and data frames, from plain data."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from pdtui.notebook.curves import Curve, Span, render_curves
from pdtui.notebook.data_frames import make_data_frame
from pdtui.notebook.sortable_table import render_sortable_table


def test_a_table_shows_rounded_numbers_and_keeps_the_whole_ones_for_sorting() -> None:
    html = render_sortable_table("a <b>", ["name", "value"], [["<x>", 1.23456], ["y", None], ["z", True]])
    root = ElementTree.fromstring(f"<div>{html}</div>")
    rows = root.findall(".//tbody/tr")
    assert [[cell.text for cell in row] for row in rows] == [["<x>", "1.23"], ["y", "–"], ["z", "yes"]]
    assert [row[1].attrib["data-v"] for row in rows] == ["1.23456", "", "1"]
    assert all("sort(" in heading.attrib["onclick"] for heading in root.findall(".//th"))


def test_curves_have_names_scales_and_spans() -> None:
    values = np.sin(np.linspace(0.0, 6.0, 5000))
    curves = [Curve("speed", "m/s", values), Curve("flat", "", np.full(3, 2.0))]
    svg = ElementTree.fromstring(render_curves(10.0, curves, [Span(2.0, 4.0, "turn <left>", "#ff0000")]))
    texts = [one.text for one in svg.iter() if one.tag.endswith("text")]
    assert {"speed (m/s)", "flat", "1", "-1", "2", "0 s", "10 s"} <= set(texts)
    lines = [one.attrib["points"].split() for one in svg.iter() if one.tag.endswith("polyline")]
    assert 300 < len(lines[0]) <= 700
    assert len(lines[1]) == 3
    (span,) = [one for one in svg.iter() if one.tag.endswith("rect")]
    assert span[0].text == "turn <left>"


def test_values_that_are_no_numbers_leave_a_gap_and_none_at_all_an_empty_curve() -> None:
    curves = [Curve("x", "", np.array([1.0, np.nan, 3.0])), Curve("y", "", np.full(2, np.nan))]
    svg = ElementTree.fromstring(render_curves(1.0, curves))
    lines = [one.attrib["points"].split() for one in svg.iter() if one.tag.endswith("polyline")]
    assert [len(line) for line in lines] == [2, 0]


def test_a_data_frame_has_a_named_index() -> None:
    pytest.importorskip("pandas")
    frame = make_data_frame({"a": [1, 2]}, "step")
    assert (frame.index.name, list(frame["a"])) == ("step", [1, 2])
