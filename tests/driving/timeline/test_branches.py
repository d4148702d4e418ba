"""Seeking and branching through the simulation's own process, and what is recorded of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pdtui.driving.drive_client import DriveClient
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.session_replay import config_from_session, replay_session
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.stimulation_map import StimulationMap

PATIENCE = 120.0


class Follower:
    """Follows a drive through its pipe, and keeps the latest facts."""

    def __init__(self, config: DriveConfig) -> None:
        self.client = DriveClient(config)
        self.facts: DriveFacts | None = None

    def until(self, wanted: Callable[[DriveSnapshot], bool]) -> DriveSnapshot:
        """Poll until a snapshot is as wanted, and return it."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            message = self.client.poll_message()
            if isinstance(message, DriveFacts):
                self.facts = message
            elif message is not None and wanted(message):
                return message
            time.sleep(0.01)
        raise AssertionError(f"nothing as wanted in {PATIENCE:g} s")


@pytest.fixture
def drive(small_map: StimulationMap, tmp_path: Path) -> Iterator[Follower]:
    follower = Follower(DriveConfig("ant", small_map, 3, recording=str(tmp_path / "drive.rrd")))
    yield follower
    follower.client.close()


def test_looking_at_the_past_changes_nothing_and_a_branch_is_a_session_of_its_own(
    drive: Follower, tmp_path: Path
) -> None:
    client, until = drive.client, drive.until
    client.press_key("w")
    until(lambda shown: shown.step > 60)
    client.seek(40)
    past = until(lambda shown: shown.past is not None)
    assert (past.step, past.paused) == (40, True)
    client.press_key("t")
    assert "present" in until(lambda shown: bool(shown.notice)).notice
    client.seek(past.past.present if past.past is not None else 0)
    present = until(lambda shown: shown.past is None)
    assert present.step == past.past.present  # type: ignore[union-attr]
    client.seek(40)
    until(lambda shown: shown.past is not None)
    client.branch()
    branched = until(lambda shown: shown.past is None and shown.step == 40)
    assert drive.facts is not None
    assert (drive.facts.branches, Path(drive.facts.recording).name) == (1, "drive-from-step-40.rrd")
    assert branched.paused
    client.press_key("t")
    at_once = until(lambda shown: bool(shown.notice))
    assert at_once.notice == "before step 40: behavior 'twitch' latched"
    assert [view.name for view in at_once.active_behaviors] == ["push", "twitch"]
    assert at_once.step == 40
    client.change_pace("pause")
    until(lambda shown: shown.step > 50)
    assert "drive-from-step-40.rrd" in client.close()

    parent, branch = read_session(tmp_path / "drive.rrd"), read_session(tmp_path / "drive-from-step-40.rrd")
    assert parent.info.branch is None
    assert parent.steps == present.step
    assert parent.outcome == f"left at step {parent.steps} for a branch from step 40"
    origin = branch.info.branch
    assert origin is not None
    assert (origin.session, origin.created, origin.step) == ("drive.rrd", parent.created, 40)
    assert [event.key for event in parent.events] == ["w"]
    assert [(event.step, event.key) for event in branch.events][1:] == [(40, "t")]
    assert (parent.digests[:40] == branch.digests[:40]).all()
    assert parent.digests[40] != branch.digests[40]
    for session in (parent, branch):
        assert replay_session(session.path).identical


def test_a_replay_is_sought_ahead_and_back_and_branched(drive: Follower, tmp_path: Path) -> None:
    drive.client.press_key("w")
    drive.until(lambda shown: shown.step > 30)
    drive.client.close()
    recorded = read_session_header(tmp_path / "drive.rrd")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        watching = Follower(config_from_session(recorded, str(recorded.path)))
        watching.client.seek(25)
        ahead = watching.until(lambda shown: shown.step >= 25)
        assert (ahead.step, ahead.past, ahead.paused) == (25, None, True)
        assert watching.facts is not None
        assert watching.facts.length == recorded.steps
        assert [press.key for press in watching.facts.known_keys] == ["w"]
        watching.client.seek(10)
        assert watching.until(lambda shown: shown.past is not None).step == 10
        watching.client.branch()
        watching.until(lambda shown: shown.past is None and shown.step == 10)
        watching.client.press_key("t")
        watching.client.change_pace("step")
        watching.until(lambda shown: shown.step == 11)
        assert watching.client.close().startswith("stopped: 11 steps")
    (branch,) = (tmp_path / "sessions").iterdir()
    header = read_session_header(branch)
    assert header.info.branch is not None
    assert (header.info.branch.session, header.info.branch.step) == ("drive.rrd", 10)
    assert replay_session(branch).identical
    assert replay_session(recorded.path).identical
