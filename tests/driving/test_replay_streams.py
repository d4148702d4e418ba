"""A session in which one value was changed does not repeat, and the replay says which value it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.core.processes import installed_packages
from pdtui.core.step_record import StepRecord
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.replays.replay_result import ReplayResult
from pdtui.driving.replays.step_by_step_comparison import StepByStepComparison
from pdtui.driving.session_replay import replay_session
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_header import read_session_header
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.stimulation_map import StimulationMap

EVENTS = {
    2: [DriveEvent(2, "behavior", "push", key="w")],
    8: [DriveEvent(8, "behavior", "hold heading", key="h")],
    30: [DriveEvent(30, "reset", key="r")],
}
Drive = tuple[DriveInfo, list[StepRecord]]
Number = TypeVar("Number", bound=np.ndarray[Any, Any])
Change = Callable[[StepRecord], StepRecord]


@pytest.fixture(scope="module")
def drive(small_map: StimulationMap) -> Drive:
    """40 control steps with a behavior, then one with a controller, and a reset."""
    loop = build_control_loop(DriveConfig("ant", small_map, 3))
    info = loop.info
    return info, [loop.advance(EVENTS.get(step, ())) for step in range(40)]


def record(
    drive: Drive, path: Path, change: Change = lambda one: one, at: range | None = None, **info: Any
) -> Path:
    """Record the drive with some steps changed."""
    described, records = drive
    with SessionRecorder(path, replace(described, **info), rows_per_write=4) as recorder:
        for one in records:
            recorder.write(change(one) if at is None or one.step in at else one)
        recorder.close("finished")
    return path


def changed(values: Number, place: int) -> Number:
    """The same with the lowest bit of one value flipped."""
    copy = values.copy()
    copy[place] = np.nextafter(copy[place], np.array(9.0, copy.dtype))
    return copy


def _magnitude(one: StepRecord) -> StepRecord:
    (held,) = one.behaviors
    return one._replace(behaviors=(replace(held, magnitude=(held.magnitude or 0.0) + 1e-9),))


def _overwritten(one: StepRecord) -> StepRecord:
    values = one.stimulation.values
    return one._replace(stimulation=replace(one.stimulation, values=(values[0] + 1e-9, *values[1:])))


def _unit(one: StepRecord) -> StepRecord:
    units = one.stimulation.units
    return one._replace(stimulation=replace(one.stimulation, units=(units[0] + 1, *units[1:])))


CHANGES: dict[str, Change] = {
    "activations 0:5 is ": lambda one: one._replace(activations=changed(one.activations, 5)),
    "attributes vx is ": lambda one: one._replace(attributes=changed(one.attributes, 0)),
    "actions 2 is ": lambda one: one._replace(action=changed(one.action, 2)),
    "poses torso_geom x is ": lambda one: one._replace(poses=one.poses + 1e-3 * (np.arange(7) == 0)),
    "rewards is ": lambda one: one._replace(reward=one.reward + 1e-9),
    "costs is ": lambda one: one._replace(cost=one.cost + 1.0),
    "episodes is 0, recorded 7": lambda one: one._replace(episode=7),
    "digests is ": lambda one: one._replace(digest=one.digest ^ 1),
    "behaviors 'hold heading' magnitude is ": _magnitude,
    "behaviors is 'hold heading', recorded none": lambda one: one._replace(behaviors=()),
    "natural 0:5 is ": lambda one: one._replace(natural=(one.natural[0] + 1e-9, *one.natural[1:])),
    "overwritten 0:5 is ": _overwritten,
    "stimulated units is '0:5', recorded '0:6'": _unit,
    "endings is none, recorded 'fell'": lambda one: one._replace(ended="fell"),
}


@pytest.mark.parametrize("found", CHANGES)
def test_one_changed_value_is_named_with_its_step(found: str, drive: Drive, tmp_path: Path) -> None:
    result = replay_session(record(drive, tmp_path / "a.rrd", CHANGES[found], range(12, 13)))
    assert not result.passed
    assert result.first_difference == 12
    assert result.verdict.startswith(f"differs: step 12 of 40: {found}")
    assert result.verdict.endswith("the recording is damaged") == (not found.startswith("digests"))


def test_an_unchanged_session_is_identical(drive: Drive, tmp_path: Path) -> None:
    kept: tuple[ActivationsKept, ...] = ("all", "half", "off")
    for activations in kept:
        result = replay_session(record(drive, tmp_path / f"{activations}.rrd", activations=activations))
        assert result.verdict == "identical: 40 steps"


def test_a_changed_activation_is_found_among_those_recorded_as_float16(drive: Drive, tmp_path: Path) -> None:
    def change(one: StepRecord) -> StepRecord:
        return one._replace(activations=one.activations + np.float32(0.01) * (np.arange(32) == 20))

    result = replay_session(record(drive, tmp_path / "a.rrd", change, range(39, 40), activations="half"))
    assert result.verdict.startswith("differs: step 39 of 40: activations 1:4 is ")


def _add_hundred(one: StepRecord) -> StepRecord:
    return one._replace(attributes=one.attributes + 100.0)


def _all_nan(one: StepRecord) -> StepRecord:
    return one._replace(attributes=np.full_like(one.attributes, np.nan))


FORGERIES: dict[str, tuple[Change, str]] = {
    "+100": (_add_hundred, "attributes vx is "),
    "NaN": (_all_nan, "attributes vx is "),
    "activation": (CHANGES["activations 0:5 is "], "activations 0:5 is "),
}


@pytest.mark.parametrize("forgery", FORGERIES)
def test_a_forged_session_is_refused_here(forgery: str, drive: Drive, tmp_path: Path) -> None:
    change, found = FORGERIES[forgery]
    result = replay_session(record(drive, tmp_path / "a.rrd", change))
    assert result.verdict.startswith(f"differs: step 0 of 40: {found}")
    assert "the recording is damaged" in result.verdict


def _replay_elsewhere(path: Path, monkeypatch: pytest.MonkeyPatch) -> ReplayResult:
    """Replay as if a library of another version were installed here."""
    monkeypatch.setattr(installed_packages, "version", lambda _: "0.0.1")
    return replay_session(path)


@pytest.mark.parametrize("forgery", ["+100", "NaN"])
def test_a_forged_session_is_refused_on_any_machine(
    forgery: str, drive: Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(drive, tmp_path / "a.rrd", FORGERIES[forgery][0])
    result = _replay_elsewhere(path, monkeypatch)
    assert result.tolerance is not None
    assert not result.passed
    assert "attributes vx" in result.verdict


@pytest.mark.parametrize("step", [0, 35])
def test_a_changed_activation_is_refused_on_any_machine_that_computes_the_same_state(
    step: int, drive: Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def change(one: StepRecord) -> StepRecord:
        return one._replace(activations=one.activations + np.float32(0.01) * (np.arange(32) == 17))

    path = record(drive, tmp_path / "a.rrd", change, range(step, 40))
    result = _replay_elsewhere(path, monkeypatch)
    assert not result.passed
    assert result.verdict.startswith(f"differs: step {step} of 40: activations 1:1 is ")


def test_rounding_is_accepted_on_another_machine(
    drive: Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(drive, tmp_path / "a.rrd", CHANGES["activations 0:5 is "])
    result = _replay_elsewhere(path, monkeypatch)
    assert result.passed
    assert not result.identical
    assert result.verdict.startswith("repeats within tolerance: bits differ from step 0 of 40 on")


@pytest.mark.parametrize(
    ("info", "found"),
    [
        ({"dt": 0.1}, "dt is 0.05, recorded 0.1"),
        ({"layers": (8, 24)}, "layers is (16, 16), recorded (8, 24)"),
    ],
)
def test_another_description_is_refused(
    info: dict[str, Any], found: str, drive: Drive, tmp_path: Path
) -> None:
    result = replay_session(record(drive, tmp_path / "a.rrd", **info))
    assert not result.passed
    assert result.verdict == f"differs: description: {found}"


def test_another_link_is_refused(drive: Drive, tmp_path: Path) -> None:
    first, *others = drive[0].links
    links = (replace(first, position=(0.0, 0.0, 0.1)), *others)
    result = replay_session(record(drive, tmp_path / "a.rrd", links=links))
    assert result.verdict == f"differs: description: link '{first.name}' is not the recorded one"


def test_steps_that_a_session_lacks_are_run_but_not_compared(drive: Drive, tmp_path: Path) -> None:
    """The header of a repaired session names the gaps; here, the recorder leaves the steps out."""
    info, records = drive
    path = tmp_path / "a.rrd"
    with SessionRecorder(path, info) as recorder:
        for one in records:
            if not 10 <= one.step < 15:
                recorder.write(one)
        recorder.close("finished")
    header = replace(read_session_header(path), steps=40, gaps=((10, 15),))
    watched = StepByStepComparison(header, info)
    assert [watched.compare(one) for one in records] == [""] * 40
    assert (watched.ended, watched.steps) == (True, 35)


def test_who_watches_is_told_what_differs_at_once(drive: Drive, tmp_path: Path) -> None:
    path = record(drive, tmp_path / "a.rrd", CHANGES["rewards is "], range(12, 13))
    watched = StepByStepComparison(read_session_header(path), drive[0])
    found = [watched.compare(one) for one in drive[1][:13]]
    assert found[:12] == [""] * 12
    assert found[12].startswith("step 12 differs from the session: rewards is ")


def test_who_watches_a_session_of_another_description_is_told_so(drive: Drive, tmp_path: Path) -> None:
    path = record(drive, tmp_path / "a.rrd", dt=0.1)
    with pytest.raises(SessionError, match=r"a\.rrd: differs: description: dt is 0\.05, recorded 0\.1"):
        StepByStepComparison(read_session_header(path), drive[0])


def test_another_number_of_actions_is_a_difference(drive: Drive, tmp_path: Path) -> None:
    path = record(drive, tmp_path / "a.rrd", lambda one: one._replace(action=one.action[:7]))
    assert replay_session(path).verdict.startswith(
        "differs: step 0 of 40: actions is '8 numbers', recorded '7 numbers'"
    )
