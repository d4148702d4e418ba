from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from pdtui.cli import main
from pdtui.core.errors import PictureError, PolicyError, RobotError
from pdtui.dissection.dissection_result import Dissection
from pdtui.pictures.unit_attribute_pairs import (
    UnitAttributePairs,
    draw_unit_attribute_pairs,
    pair_units_with_attributes,
)


@pytest.fixture(scope="module")
def curves(policy_file: Path) -> UnitAttributePairs:
    return pair_units_with_attributes("ant", str(policy_file), episodes=2, steps=130, seed=1000)


def test_main_attributes_come_with_the_units_that_match_them(
    curves: UnitAttributePairs, dissection: Dissection
) -> None:
    """The same roll-outs as those of the dissection, so the same matches."""
    assert [pair.attribute.name for pair in curves.pairs] == ["vx", "vy", "speed", "yaw", "yaw rate", "roll"]
    for pair in curves.pairs:
        column = dissection.column(pair.attribute.name)
        assert [pair.unit] == dissection.matches(pair.attribute.name, 1)
        unit = int(dissection.matching.ranked_units(column)[0])
        assert pair.discrepancy == dissection.matching.discrepancy[column, unit]
        np.testing.assert_array_equal(pair.values, dissection.sample_episode.attributes[:, column])
        np.testing.assert_array_equal(
            pair.activation, dissection.sample_episode.activations[:, dissection.sample_episode.column(unit)]
        )
    assert curves.times[[0, -1]] == pytest.approx([0.05, 6.5])


def test_a_pair_may_be_named(policy_file: Path) -> None:
    curves = pair_units_with_attributes(
        "ant", str(policy_file), attributes=["height", "vx"], units=["1:3", "0:0"], episodes=1, steps=64
    )
    assert [(pair.attribute.name, pair.unit) for pair in curves.pairs] == [("height", "1:3"), ("vx", "0:0")]


@pytest.mark.parametrize(
    ("attributes", "units", "error", "message"),
    [
        (["vx"], ["0:1", "0:2"], PictureError, "got 2 units and 1 attributes"),
        (["warp"], [], RobotError, "no attribute 'warp'"),
        (["vx"], ["7:0"], PolicyError, "unit 7:0 does not exist"),
    ],
)
def test_what_does_not_exist_is_named(
    attributes: list[str], units: list[str], error: type[Exception], message: str, policy_file: Path
) -> None:
    with pytest.raises(error, match=message):
        pair_units_with_attributes(
            "ant", str(policy_file), attributes=attributes, units=units, episodes=1, steps=64
        )


def test_each_pair_is_drawn_in_its_color(curves: UnitAttributePairs, tmp_path: Path) -> None:
    path = tmp_path / "new" / "episode.png"
    draw_unit_attribute_pairs(path, curves)
    with Image.open(path) as image:
        assert image.format == "PNG"
        picture = np.array(image.convert("RGB"))
    for color in ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233)):
        rows = np.flatnonzero((picture == color).all(axis=2).sum(axis=1) > 3)
        assert rows.size, color
        assert np.ptp(rows) < picture.shape[0] / 5, color


def test_an_episode_that_is_over_says_so(curves: UnitAttributePairs, tmp_path: Path) -> None:
    with pytest.raises(PictureError, match=r"the episode lasts 6\.5 s; nothing is left to show from 7 s on"):
        draw_unit_attribute_pairs(tmp_path / "x.png", curves, start=7.0)
    assert list(tmp_path.iterdir()) == []


def test_the_command_draws_once_and_keeps_what_it_drew(policy_file: Path, tmp_path: Path) -> None:
    arguments = ["figure", "episode", "ant", "--policy", str(policy_file), "--attribute", "yaw rate"]
    arguments += ["--unit", "1:5", "--seconds", "4", "-o", str(tmp_path / "pair.png")]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    assert "yaw rate: unit 1:5, discrepancy" in result.output
    drawn = (tmp_path / "pair.png").read_bytes()
    again = CliRunner().invoke(main, arguments)
    assert again.exit_code == 1
    assert "pair.png: already exists; --overwrite replaces it" in again.output
    assert (tmp_path / "pair.png").read_bytes() == drawn
