"""Sessions of two robots in one real viewer, each under its own names and in its own layout."""

from __future__ import annotations

from pathlib import Path

import pytest

import pdtui
from tests.real_viewer import RealViewer, is_blank


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A session of the Ant and one of the BipedalWalker."""
    folder = tmp_path_factory.mktemp("robots")
    for robot in ("ant", "bipedal_walker"):
        pdtui.drive(robot, steps=40, record=folder / f"{robot}.rrd")
    return folder / "ant.rrd", folder / "bipedal_walker.rrd"


@pytest.mark.viewer
def test_each_is_shown_under_its_own_names(viewer: RealViewer, sessions: tuple[Path, Path]) -> None:
    shown: dict[str, list[str]] = {}
    for path in (*sessions, sessions[0]):
        viewer.show(path)
        robot = path.stem
        names = viewer.view_names()
        assert f"Robot {robot}, policy {robot}; its path in the colors of the behaviors" in names
        assert not is_blank(viewer.picture(f"beside-another-{robot}", step=20))
        assert shown.setdefault(robot, names) == names
    ant, walker = shown.values()
    assert not any("foot 1 contact" in name for name in ant)
    assert any("foot 1 contact" in name for name in walker)
