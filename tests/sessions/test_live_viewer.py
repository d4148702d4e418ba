"""A drive shown while it is driven, in the real viewer."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from pdtui.core.errors import SessionError
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.real_viewer import RealViewer, is_blank, real_viewer
from tests.sessions.recorded_drives import events_of, make_loop


@pytest.fixture
def own_viewer() -> Iterator[RealViewer]:
    """One that the test may end."""
    with real_viewer() as viewer:
        yield viewer


@pytest.mark.viewer
def test_a_drive_is_in_the_viewer_while_it_is_driven(
    viewer: RealViewer, tmp_path: Path, weights: Path
) -> None:
    loop = make_loop(weights)
    path, address = tmp_path / "live.rrd", ViewerAddress(port=viewer.port)
    with SessionRecorder(path, loop.info, rows_per_write=4, viewer=address) as recorder:
        for step in range(100):
            recorder.write(loop.advance(events_of(step)))
        viewer.wait_for(
            lambda state: (
                any(
                    timeline.name == "step" and (timeline.end or 0) > 90
                    for recording in state.recordings
                    if recording.store_id == state.active_recording
                    for timeline in recording.timelines
                )
                and any(view.name == "Behaviors" for view in state.views)
            )
        )
        assert not is_blank(viewer.picture("live", step=50))
        assert not any(name.startswith("All activations") for name in viewer.view_names())
        recorder.close("the operator quit")
    viewer.wait_for(lambda state: any(view.name.startswith("All activations") for view in state.views))
    assert read_session(path).outcome == "the operator quit"


@pytest.mark.viewer
@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGSTOP])
def test_a_viewer_that_goes_away_leaves_the_session_whole(
    own_viewer: RealViewer, tmp_path: Path, weights: Path, ending: signal.Signals
) -> None:
    loop = make_loop(weights)
    address = ViewerAddress(port=own_viewer.port)
    with SessionRecorder(tmp_path / "a.rrd", loop.info, rows_per_write=4, viewer=address) as recorder:
        for step in range(100):
            recorder.write(loop.advance(events_of(step)))
            if step == 30:
                own_viewer.wait_for(lambda state: bool(state.recordings))
                own_viewer.signal(ending)
        recorder.close("the operator quit")
    session = read_session(tmp_path / "a.rrd")
    assert session.outcome == "the operator quit"
    assert session.steps == 100


def test_addresses_are_ports_hosts_or_both() -> None:
    assert str(ViewerAddress.parse("9000")) == "127.0.0.1:9000"
    assert str(ViewerAddress.parse("10.0.0.2:9000")) == "10.0.0.2:9000"
    assert str(ViewerAddress.parse("desk")) == "desk:9876"
    for wrong in ("", "0", "99999", "desk:", "http://desk", "a b"):
        with pytest.raises(SessionError, match="expected PORT, HOST or HOST:PORT"):
            ViewerAddress.parse(wrong)
