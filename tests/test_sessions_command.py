"""`pdtui sessions`: what it prints, what it writes and how it ends."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow.csv
import pyarrow.parquet
import pytest
from click.testing import CliRunner, Result

from pdtui.cli import main
from pdtui.core.attributes import Attribute, Floats
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.sessions.session_reader import read_activations, read_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_library import shipped_folder
from pdtui.stimulation.map_reader import load_map
from tests.obstacle_course import Course, course_loop

KEYS = "10 w\n20 t\n30 space\n35 h\n40 left\n50 r\n"


def run(*arguments: str | Path | int, columns: int | None = None) -> Result:
    # Without it, a worker of xdist would say how wide its terminal is.
    environment = {"COLUMNS": None if columns is None else str(columns)}
    return CliRunner().invoke(main, [str(argument) for argument in arguments], env=environment)


@pytest.fixture(scope="module")
def folder(map_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive, the same cut, and a file of garbage."""
    folder = tmp_path_factory.mktemp("sessions")
    keys = folder / "keys.txt"
    keys.write_text(KEYS)
    done = run(
        *("drive", "ant", "--map", map_path, "--headless", "--keys", keys, "--steps", 80),
        *("--record", folder / "a.rrd"),
    )
    assert done.exit_code == 0, done.output
    whole = (folder / "a.rrd").read_bytes()
    (folder / "cut.rrd").write_bytes(whole[: len(whole) * 9 // 10])
    (folder / "garbage.rrd").write_bytes(b"\x1b]0;obey me\x07 [red]" * 50)
    return folder


def test_the_list_shows_good_and_broken_files(folder: Path) -> None:
    shown = run("sessions", "list", folder, columns=80)
    assert shown.exit_code == 0, shown.output
    rows = {line.split()[0]: line for line in shown.output.splitlines() if line[:1].strip()}
    assert rows["a.rrd"].split()[1:5] == ["ant", "4.0", "s", "6"]
    assert rows["a.rrd"].split()[-1] == "finished"
    assert "broken: the file is torn" in rows["cut.rrd"]
    assert "broken: expected a" in rows["garbage.rrd"]
    assert all(len(line) <= 80 for line in shown.output.splitlines())
    data = json.loads(run("sessions", "list", folder, "--json").output)["sessions"]
    assert [row["broken"] == "" for row in data] == [True, False, False]
    assert (data[0]["steps"], data[0]["keys"], data[0]["outcome"]) == (80, 6, "finished")


def test_the_list_does_not_split_a_name_and_cuts_nothing_in_a_pipe(folder: Path, tmp_path: Path) -> None:
    name = "bipedal_walker-20261127-175936-seed123.rrd"
    shutil.copy(folder / "a.rrd", tmp_path / name)
    shutil.copy(folder / "cut.rrd", tmp_path)
    narrow = run("sessions", "list", tmp_path, columns=80)
    assert name in narrow.output
    piped = run("sessions", "list", tmp_path).output.splitlines()
    assert len(piped) == 3  # the headings, and one line for each session
    (broken,) = (line for line in piped if line.startswith("cut.rrd"))
    assert "`pdtui sessions repair` rescues what is whole" in broken


def test_show_tells_the_drive_key_by_key(folder: Path, map_text: str) -> None:
    shown = run("sessions", "show", folder / "a.rrd", columns=80)
    assert shown.exit_code == 0, shown.output
    lines = [line.split() for line in shown.output.splitlines()]
    assert ["0.50", "s", "10", "w", "behavior", "'push'", "latched"] in lines
    assert ["2.50", "s", "50", "r", "next", "episode", "started"] in lines
    assert all(len(line) <= 80 for line in shown.output.splitlines())
    data = json.loads(run("sessions", "show", folder / "a.rrd", "--json").output)
    session = read_session(folder / "a.rrd")
    assert data["map"] == map_text
    assert data["involvement"] == 6
    assert data["total_reward"] == pytest.approx(float(session.rewards.sum()))
    assert data["attributes"][0]["mean"] == pytest.approx(float(session.attributes[:, 0].mean()))


def test_verify_says_what_is_whole_and_what_repeats(folder: Path) -> None:
    good = run("sessions", "verify", folder / "a.rrd")
    assert (good.exit_code, good.stdout) == (
        0,
        f"{folder / 'a.rrd'}: whole, checksums match; identical: 80 steps\n",
    )
    bad = run("sessions", "verify", folder / "a.rrd", folder / "cut.rrd", "--json")
    assert bad.exit_code == 1
    one, other = json.loads(bad.output)["sessions"]
    assert (one["whole"], one["repeats"], one["steps"]) == (True, True, 80)
    assert (other["whole"], other["repeats"]) == (False, None)
    assert "torn" in other["broken"]


def test_a_cut_file_is_repaired_and_then_verifies(folder: Path, tmp_path: Path) -> None:
    whole = (folder / "a.rrd").read_bytes()
    for number, share in enumerate((0.55, 0.8, 0.97)):
        torn = tmp_path / f"{number}.rrd"
        torn.write_bytes(whole[: int(len(whole) * share)])
        repaired = run("sessions", "repair", torn)
        assert repaired.exit_code == 0, repaired.output
        assert torn.read_bytes() == whole[: int(len(whole) * share)]
        verified = run("sessions", "verify", tmp_path / f"{number}.repaired.rrd")
        assert verified.exit_code == 0, verified.output
        assert "identical: " in verified.output
    assert "already exists" in run("sessions", "repair", torn).output
    assert run("sessions", "repair", torn, "--in-place").exit_code == 0
    assert "whole; nothing to repair" in run("sessions", "repair", torn).output


def test_streams_are_exported_as_they_are(folder: Path, tmp_path: Path) -> None:
    path = folder / "a.rrd"
    listed = run("sessions", "export", path)
    names = [line.split()[0] for line in listed.output.splitlines()]
    for name in names:
        done = run("sessions", "export", path, "--stream", name, "-o", tmp_path / f"{name}.parquet")
        assert done.exit_code == 0, done.output
    session = read_session(path)
    attributes = pyarrow.parquet.read_table(tmp_path / "attributes.parquet")
    assert attributes.column_names[:3] == ["step", "time", "vx (m/s)"]
    assert attributes.column("vx (m/s)").to_pylist() == session.attributes[:, 0].tolist()
    activations = pyarrow.parquet.read_table(tmp_path / "activations.parquet")
    assert activations.column("1:2").to_numpy().tobytes() == read_activations(path)[:, 18].tobytes()
    behaviors = pyarrow.parquet.read_table(tmp_path / "behaviors.parquet").to_pylist()
    assert behaviors[0] | {"remaining": None} == behaviors[0]
    assert (behaviors[0]["step"], behaviors[0]["behavior"]) == (10, "push")
    stimulation = pyarrow.parquet.read_table(tmp_path / "stimulation.parquet").to_pylist()
    assert (stimulation[0]["unit"], stimulation[0]["overwritten"]) == ("0:3", -2.0)
    assert run("sessions", "export", path, "--stream", "events", "-o", tmp_path / "e.csv").exit_code == 0
    events = pyarrow.csv.read_csv(tmp_path / "e.csv").to_pylist()
    assert [(row["step"], row["key"]) for row in events][:2] == [(10, "w"), (20, "t")]
    again = run("sessions", "export", path, "--stream", "events", "-o", tmp_path / "e.csv")
    assert "e.csv: already exists" in again.output
    assert (
        "no stream 'nothing'"
        in run("sessions", "export", path, "--stream", "nothing", "-o", tmp_path / "p.csv").output
    )


def test_exported_keystrokes_drive_the_same_drive(folder: Path, map_path: Path, tmp_path: Path) -> None:
    keys, again = tmp_path / "keys.txt", tmp_path / "again.rrd"
    assert run("sessions", "export", folder / "a.rrd", "--keys", keys).exit_code == 0
    assert keys.read_text() == KEYS
    run(
        *("drive", "ant", "--map", map_path, "--headless", "--keys", keys, "--steps", 80),
        *("--record", again),
    )
    same = run("sessions", "compare", folder / "a.rrd", again)
    assert same.exit_code == 0, same.output
    assert same.output.startswith("identical: 80 steps")


def test_compare_names_the_first_step_and_how_far_it_goes(
    folder: Path, map_path: Path, tmp_path: Path
) -> None:
    keys, other = tmp_path / "keys.txt", tmp_path / "other.rrd"
    keys.write_text("10 w\n23 t\n")
    run(
        *("drive", "ant", "--map", map_path, "--headless", "--keys", keys, "--steps", 60),
        *("--record", other),
    )
    result = run("sessions", "compare", folder / "a.rrd", other, "--json")
    assert result.exit_code == 3
    data = json.loads(result.output)
    one, two = read_session(folder / "a.rrd"), read_session(other)
    assert (data["first_difference"], data["steps"], data["lengths"]) == (20, 60, [80, 60])
    assert data["first_event"].startswith("event 1: behavior 'twitch' latched before step 20 in the first")
    found = {row["attribute"]: row for row in data["deviations"]}
    change = abs(one.attributes[20:60, 0] - two.attributes[20:60, 0])
    assert found["vx"]["first"] == pytest.approx(change[0])
    assert found["vx"]["largest"] == pytest.approx(change.max())
    assert found["vx"]["step"] == 20 + int(change.argmax())
    shown = run("sessions", "compare", folder / "a.rrd", other).output
    assert shown.startswith("differ from step 20 of 60 on; they have 80 and 60 steps")


def test_text_from_files_is_harmless(map_path: Path, tmp_path: Path) -> None:
    from pdtui.sessions.writer.session_recorder import SessionRecorder

    loop = build_control_loop(DriveConfig("ant", load_map(map_path), 3))
    with SessionRecorder(tmp_path / "evil.rrd", loop.info) as recorder:
        recorder.write(loop.advance())
        recorder.close("\x1b[2J\x1b]0;owned\x07[bold]finished[/bold]")
    commands: list[list[str | Path]] = [["list", tmp_path], ["show", tmp_path / "evil.rrd"]]
    for command in commands:
        output = run("sessions", *command).output
        assert "\x1b" not in output
        assert "\x07" not in output
        assert "[bold]" in output


def test_the_viewer_is_bound_to_this_machine(folder: Path, tmp_path: Path) -> None:
    """The program that is started writes down what it was told: a viewer needs a display and a person."""
    from pdtui.sessions.viewer import viewer_address

    environment = {**os.environ, "DISPLAY": ""}
    environment.pop("WAYLAND_DISPLAY", None)
    command = [sys.executable, "-m", "pdtui", "sessions", "open", str(folder / "a.rrd")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no display for the viewer's window" in done.stderr
    told = viewer_address.viewer_command_line(folder / "a.rrd", web=True)
    assert told[1:] == [str(folder / "a.rrd"), "--bind", "127.0.0.1", "--serve-web"]
    assert "garbage.rrd: expected a Rerun" in run("sessions", "open", folder / "garbage.rrd").output


def test_another_processor_repeats_within_the_tolerance() -> None:
    """The shipped sample, summed in the order of an older processor: other bits, the same first steps."""
    sample = shipped_folder("sessions") / "samples" / "ant.rrd"
    environment = {**os.environ, "OPENBLAS_CORETYPE": "Nehalem"}

    def verify(*more: str) -> tuple[int, dict[str, Any]]:
        command = [sys.executable, "-m", "pdtui", "sessions", "verify", str(sample), "--json", *more]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        (row,) = json.loads(done.stdout)["sessions"]
        return done.returncode, row

    code, row = verify()
    if row["identical"]:
        pytest.skip("this machine computes the sample in that order anyway")
    assert code == 0, row
    assert any(line.startswith("blas: ") and line.endswith("Nehalem here") for line in row["environment"])
    assert row["tolerance"] == 5e-6
    assert row["judged"] == 5
    assert 5 <= row["agreed"] < row["total"]
    assert row["deviations"][0]["largest"] > 0.1
    code, row = verify("--strict")
    assert (code, row["repeats"], row["tolerance"]) == (3, False, None)
    code, row = verify("--tolerance", "0")
    assert (code, row["repeats"]) == (3, False)


def test_a_session_with_obstacles_but_no_distance_is_shown(tmp_path: Path) -> None:
    class Undirected(Course):
        attributes = (Attribute("vx", "m/s"),)

        def read_attributes(self) -> Floats:
            return super().read_attributes()[:1]

    usual = course_loop()
    loop = ControlLoop(Undirected(), usual.policy, usual.map, 1)
    with SessionRecorder(tmp_path / "course.rrd", loop.info) as recorder:
        for _ in range(20):
            recorder.write(loop.advance())
    shown = run("sessions", "show", tmp_path / "course.rrd")
    assert shown.exit_code == 0, shown.output
    assert "collisions" in shown.output
