from __future__ import annotations

import json
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image
from rerun.chunk import RrdReader

from pdtui.core.confidence_intervals import bootstrap_interval
from pdtui.core.errors import PictureError, SessionError
from pdtui.core.units import format_unit, parse_unit
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarize_dissection
from pdtui.pictures.dissection_attribute_plots import draw_ranking, draw_spectrograms
from pdtui.pictures.dissection_report import write_dissection_report
from pdtui.sessions.session_reader import read_session
from tests.pictures.report_contents import read_entities, read_origins
from tests.real_viewer import RealViewer, is_blank

Entities = dict[str, dict[str, list[Any]]]


@pytest.fixture(scope="module")
def report(dissection: Dissection, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reports") / "new" / "ant.rrd"
    write_dissection_report(path, dissection)
    return path


@pytest.fixture(scope="module")
def entities(report: Path) -> Entities:
    return read_entities(report)


def test_only_the_report_is_left_and_it_is_no_session(report: Path) -> None:
    assert [path.name for path in report.parent.iterdir()] == ["ant.rrd"]
    assert len(RrdReader(report).recordings()) == 1
    with pytest.raises(SessionError, match="expected a recording of pdtui, found one of 'pdtui-dissection'"):
        read_session(report)


def test_every_view_of_the_layout_shows_an_entity_that_exists(report: Path, entities: Entities) -> None:
    origins = read_origins(report)
    assert {"/summary", "/attributes/yaw\\ rate/figure", "/side_effects"} <= origins
    for origin in origins:
        assert any(entity == origin or entity.startswith(f"{origin}/") for entity in entities), origin


def test_bars_are_the_discrepancies(dissection: Dissection, entities: Entities) -> None:
    for name in ("vx", "yaw rate", "height"):
        column = dissection.column(name)
        ranking = entities[f"/attributes/{name.replace(' ', chr(92) + ' ')}/discrepancies"]
        nearest = np.argsort(dissection.matching.discrepancy[column], kind="stable")[:12]
        assert ranking["unit"] == [format_unit(int(unit), dissection.layers) for unit in nearest]
        np.testing.assert_array_equal(
            ranking["discrepancy"], dissection.matching.discrepancy[column, nearest]
        )
        panel = Figure().subplots()
        draw_ranking(panel, dissection, column)
        assert [bar.get_width() for bar in panel.patches if isinstance(bar, Rectangle)] == ranking[
            "discrepancy"
        ]
        assert [label.get_text() for label in panel.get_yticklabels()] == ranking["unit"]


def test_each_attribute_has_its_page(entities: Entities) -> None:
    pages = {entity: part for entity, part in entities.items() if entity.endswith("/figure")}
    assert len(pages) == 16 + 2
    pictures = set()
    for part in pages.values():
        (content,) = part["EncodedImage:blob"]
        with Image.open(BytesIO(bytes(content))) as picture:
            assert picture.format == "PNG"
            assert not is_blank(np.asarray(picture.convert("RGB").reduce(6)))
        pictures.add(bytes(content))
    assert len(pictures) == len(pages)


@pytest.mark.viewer
def test_the_viewer_opens_it_without_a_complaint(viewer: RealViewer, report: Path) -> None:
    viewer.show(report)
    assert not is_blank(viewer.picture("dissection"))


def test_curves_are_the_refined_effects_with_their_intervals(
    dissection: Dissection, entities: Entities
) -> None:
    column, refined = dissection.column("speed"), dissection.refined
    start = "/attributes/speed/effects/unit"
    curves = {
        entity: part for entity, part in entities.items() if entity.startswith(start) and "effect" in part
    }
    best = summarize_dissection(dissection)["attributes"][column]
    shown = {best["probed"][0]["unit"], best["first_match"]["unit"]}
    assert len(curves) == len(shown)
    for entity, curve in curves.items():
        address = entity.replace("\\", "").split("unit ")[1].split(",")[0]
        assert address in shown
        row = refined.units.index(parse_unit(address, dissection.layers))
        assert curve["output"] == [-3.0, 0.0, 3.0]
        for dose, effect in enumerate(curve["effect"]):
            samples = refined.effects[row, dose, :, column]
            assert effect == pytest.approx(np.nanmean(samples))
            low, high = bootstrap_interval(samples, dissection.seed)
            assert (curve["low"][dose], curve["high"][dose]) == pytest.approx((low, high))


def test_the_side_effect_matrix_is_the_measured_one(dissection: Dissection, entities: Entities) -> None:
    summary = summarize_dissection(dissection)["side_effects"]
    numbers = entities["/side_effect_numbers/v\\ \\=\\ 3"]
    tensor, units = numbers["Tensor:data"][0], numbers["units"]
    shape, cells = tensor["shape"], np.array(tensor["buffer"])
    assert len(units) == shape[0]
    rows = [summary["units"].index(unit) for unit in units]
    wanted = np.array(summary["by_value"]["3"], np.float64)[rows]
    np.testing.assert_array_equal(cells.reshape(shape), wanted)


def test_spectrograms_share_their_colors_and_show_the_loudest_cell(dissection: Dissection) -> None:
    figure = Figure()
    left, right = figure.subplots(1, 2)
    draw_spectrograms(figure, left, right, dissection, dissection.column("height"))
    meshes = [panel.collections[0] for panel in (left, right)]
    (low, high), others = (mesh.get_clim() for mesh in meshes)
    assert (low, high) == others
    assert high - low == pytest.approx(60.0)
    loudest = [float(np.asarray(mesh.get_array()).max()) for mesh in meshes]
    assert max(loudest) == pytest.approx(high, abs=1e-3)
    assert min(float(np.asarray(mesh.get_array()).min()) for mesh in meshes) >= low - 1e-3


def test_the_episode_is_the_monitored_one(dissection: Dissection, entities: Entities) -> None:
    column = dissection.column("pitch")
    unit = int(dissection.matching.ranked_units(column)[0])
    shown = entities["/attributes/pitch/episode/unit"]["Scalars:scalars"]
    np.testing.assert_allclose(
        shown, dissection.sample_episode.activations[:, dissection.sample_episode.column(unit)]
    )
    shown = entities["/attributes/pitch/episode/attribute"]["Scalars:scalars"]
    np.testing.assert_array_equal(shown, dissection.sample_episode.attributes[:, column])


def test_text_and_properties_say_what_it_was_made_from(dissection: Dissection, entities: Entities) -> None:
    (text,) = entities["/summary"]["TextDocument:text"]
    first = summarize_dissection(dissection)["attributes"][0]
    row = f"| vx | {first['frequency']:.2f} | {first['matches'][0]['unit']} |"
    heading = "## Probing: effects of units, 3 starts, beside 6 random units"
    for fact in (dissection.policy_hash, f"| seed | {dissection.seed};", heading, row):
        assert fact in text
    headings = [
        "# Dissection",
        "## What was found",
        "## What was not found",
        "## What these figures cannot tell",
    ]
    places = [text.index(one) for one in [*headings, "## Where it comes from", heading]]
    assert places == sorted(places)
    # Three starts allow no p-value below 2 ** -2.
    assert "Nothing could be confirmed: with 3 starts and 6 random units no p-value is below 0.25" in text
    stored = json.loads(entities["/__properties/dissection"]["summary"][0])
    assert stored == summarize_dissection(dissection)


def test_an_attribute_that_was_left_out_leaves_its_pictures_out(
    dissection: Dissection, tmp_path: Path
) -> None:
    matching = dissection.matching
    broken = replace(
        matching,
        discrepancy=np.where(np.arange(16)[:, None] == 4, np.nan, matching.discrepancy),
        flaws={"yaw rate": "not finite in the episodes of seeds [1000]; left out"},
    )
    path = tmp_path / "flawed.rrd"
    write_dissection_report(path, replace(dissection, matching=broken))
    entities = read_entities(path)
    drawn = [entity for entity in entities if entity.startswith("/attributes/yaw\\ rate/")]
    assert drawn
    assert not any("discrepancies" in entity for entity in drawn)
    for origin in read_origins(path):
        assert any(entity == origin or entity.startswith(f"{origin}/") for entity in entities), origin
    assert "yaw rate: not finite" in entities["/summary"]["TextDocument:text"][0]


def test_a_folder_that_cannot_be_made_is_named(dissection: Dissection, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(PictureError, match="file/ant.rrd: cannot be written"):
        write_dissection_report(tmp_path / "file" / "ant.rrd", dissection)
