"""What a session looks like in the real viewer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.real_viewer import RealViewer, is_blank
from tests.sessions.conftest import Recorded

SAMPLE = Path(__file__).parents[2] / "sessions" / "samples" / "ant.rrd"


@pytest.mark.viewer
def test_the_sample_session_opens_without_a_complaint(viewer: RealViewer) -> None:
    viewer.show(SAMPLE)
    assert not is_blank(viewer.picture("sample", step=480))


@pytest.mark.viewer
def test_a_session_of_another_policy_and_map_opens_laid_out(viewer: RealViewer, recorded: Recorded) -> None:
    path, _, _ = recorded
    viewer.show(path)
    assert not is_blank(viewer.picture("session", step=50))
    assert "Behaviors" in viewer.view_names()
