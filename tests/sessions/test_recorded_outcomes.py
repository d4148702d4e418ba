"""Sessions say how episodes ended; those that are older than the words tell it by their reasons."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.outcome import Outcome
from pdtui.driving.headless_drive import drive_headless
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.export.export_writer import export_stream
from pdtui.sessions.recorded_outcomes import decode_outcomes
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_header_decoding import scan_session_header
from pdtui.sessions.session_repair import repair_session
from pdtui.sessions.session_summary import read_session_summary, summarize_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.road import Road, road_loop

KEYS = {41: ["a"], 62: ["d"], 84: ["b"], 160: ["space"]}
OUTCOMES = {39: "arrived", 61: "left the road", 81: "crashed", 141: "out of time", 181: "arrived"}


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five episodes, which end in every way that the road knows, and the beginning of a sixth."""
    path = tmp_path_factory.mktemp("road") / "road.rrd"
    loop = road_loop()
    drive_headless(loop, KEYS, 200, SessionRecorder(path, loop.info))
    return path


def test_a_session_has_the_words_with_and_without_its_index(driven: Path) -> None:
    header = read_session_header(driven)
    assert header.outcomes == scan_session_header(driven).outcomes == OUTCOMES
    assert set(header.endings) == set(OUTCOMES)
    assert header.endings[61] == "off the asphalt"


def test_its_summary_counts_them_and_names_that_of_each_episode(driven: Path) -> None:
    header = read_session_header(driven)
    summary = read_session_summary(header)
    assert summary == summarize_session(header)
    assert summary.outcomes == {"arrived": 2, "crashed": 1, "left the road": 1, "out of time": 1}
    assert [tally.outcome for tally in summary.tallies] == [*OUTCOMES.values(), ""]


def test_a_replay_compares_the_words(driven: Path) -> None:
    policy = road_loop().policy
    assert replay_session(driven, robot=Road(), policy=policy).identical

    class _Denier(Road):
        def step(self, action):  # type: ignore[no-untyped-def]
            *result, info = super().step(action)
            return (*result, info | {"outcome": "fell"} if info.get("outcome") == "crashed" else info)

    result = replay_session(driven, robot=_Denier(), policy=policy)
    assert (result.first_difference, result.detail) == (81, "outcomes is 'fell', recorded 'crashed'")


def test_an_arrival_after_which_the_episode_goes_on_is_recorded_once(tmp_path: Path) -> None:
    class _Tourist(Road):
        def step(self, action):  # type: ignore[no-untyped-def]
            observation, reward, _, truncated, info = super().step(action)
            return observation, reward, False, truncated, info

    loop = road_loop()
    loop.robot = _Tourist()
    loop.robot.reset(seed=0)
    drive_headless(loop, {}, 60, SessionRecorder(tmp_path / "a.rrd", loop.info))
    header = read_session_header(tmp_path / "a.rrd")
    assert (header.outcomes, header.endings) == ({39: "arrived"}, {})
    assert read_session_summary(header).outcomes == {"arrived": 1}


def test_a_repair_and_an_export_keep_them(driven: Path, tmp_path: Path) -> None:
    cut, repaired, table = (tmp_path / name for name in ("cut.rrd", "repaired.rrd", "gains.csv"))
    cut.write_bytes(driven.read_bytes()[:-200])
    repair_session(cut, repaired)
    assert read_session_header(repaired).outcomes == OUTCOMES
    export_stream(repaired, "gains", table)
    rows = table.read_text().splitlines()
    assert rows[62].endswith('"off the asphalt","left the road"')
    assert rows[63].endswith(",,")


def test_reasons_tell_what_older_sessions_do_not_say() -> None:
    reasons = {
        3: "fell: leans by 54°",
        8: "the simulation diverged at 0.4 s",
        9: "walked off the end of the ground",
        12: "the environment ended the episode",
    }
    found = decode_outcomes([], reasons)
    assert found == {3: Outcome.FELL, 8: Outcome.DIVERGED, 9: Outcome.LEFT_ROAD}
    assert decode_outcomes([(12, "arrived"), (3, "crashed")], reasons)[12] is Outcome.ARRIVED
    with pytest.raises(ValueError, match="expected one of arrived, fell, .* found 'exploded'"):
        decode_outcomes([(1, "exploded")], {})
