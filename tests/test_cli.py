"""The commands: what they print, and one clear line for every mistake."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

import pdtui
from pdtui.cli import COMMANDS, main
from pdtui.cli.command_group import OPTIONAL_ROOMS, LazyCommandGroup
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.real_viewer import RealViewer, free_port, is_blank


def run(*arguments: str | Path | int) -> Result:
    # A worker of xdist would say how wide its terminal is.
    return CliRunner().invoke(main, [str(argument) for argument in arguments], env={"COLUMNS": None})


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    path = tmp_path / "keys.txt"
    path.write_text("10 w\n20 t\n30 space\n35 h\n40 left  # turn\n50 r\n")
    return path


def test_a_headless_drive_is_recorded_and_replays_in_a_fresh_process(
    map_path: Path, keys: Path, tmp_path: Path
) -> None:
    session = tmp_path / "out.rrd"
    drive = run(
        "drive", "ant", "--map", map_path, "--headless", "--keys", keys, "--steps", 80, "--record", session
    )
    assert drive.exit_code == 0, drive.output
    assert "80 steps, 4 s simulated" in drive.output
    assert "steps with a key 6" in drive.output
    replay = subprocess.run(
        [sys.executable, "-m", "pdtui", "replay", str(session)], capture_output=True, text=True, check=False
    )
    assert replay.returncode == 0, replay.stderr
    assert replay.stdout == "identical: 80 steps\n"


def test_a_headless_drive_is_recorded_into_the_folder_of_sessions_unless_told_otherwise(
    map_path: Path, keys: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    drive = ("drive", "ant", "--map", map_path, "--headless", "--keys", keys, "--steps", 60, "--seed", 7)
    unrecorded = run(*drive, "--no-record")
    assert unrecorded.exit_code == 0, unrecorded.output
    assert not (tmp_path / "sessions").exists()
    driven = run(*drive)
    assert driven.exit_code == 0, driven.output
    (session,) = Path("sessions").iterdir()
    assert session.match("ant-*-seed7.rrd")
    assert driven.stdout.endswith(f"recorded in {session}\n")
    assert run("replay", session).stdout == "identical: 60 steps\n"
    both = run(*drive, "--no-record", "--record", "a.rrd")
    assert both.output == "pdtui: --record and --no-record are mutually exclusive\n"


def test_a_replay_names_the_first_step_that_differs(map_path: Path, tmp_path: Path) -> None:
    """The same drive with another disturbance: a session whose robot was pushed behind the loop's back."""
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.driving.loop_builder import build_control_loop
    from pdtui.sessions.writer.session_recorder import SessionRecorder
    from pdtui.stimulation.map_reader import load_map

    loop = build_control_loop(DriveConfig("ant", load_map(map_path), 3))
    session = tmp_path / "pushed.rrd"
    with SessionRecorder(session, loop.info) as recorder:
        for step in range(40):
            if step == 25:
                loop.robot.data.qvel[0] += 0.5  # type: ignore[attr-defined]
            recorder.write(loop.advance())
        recorder.close("finished")
    result = run("replay", session)
    assert result.exit_code == 1
    assert "differs: step 25 of 40: " in result.output
    assert "is off by" in result.output


def test_a_policy_that_the_robots_map_was_not_made_for_drives_alone(policy_file: Path) -> None:
    drive = run("drive", "ant", "--policy", policy_file, "--headless", "--steps", 3, "--no-record")
    assert drive.exit_code == 0, drive.output
    assert f"ant.toml: made for another policy than {policy_file}; driving without behaviors" in drive.output
    alone = run("evaluate", "ant", "--policy", policy_file, "--policy-only", "--seeds", "100", "--json")
    assert alone.exit_code == 0, alone.output
    for named in (("--map", "ant"), ("--force",)):
        drive = run("drive", "ant", *named, "--policy", policy_file, "--headless", "--steps", 3)
        assert drive.exit_code == 1, drive.output


def test_evaluate_prints_the_agreed_json(map_path: Path) -> None:
    few = ("--seeds", "100", "--quick", "--hold", 100)
    result = run("evaluate", "ant", "--map", map_path, *few, "--json")
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert (data["robot"], data["policy"], data["seeds"]) == ("ant", "small", [100])
    assert {row["behavior"] for row in data["behaviors"]} == {"push"}
    push = data["behaviors"][0]
    assert {"condition", "criterion", "onset", "lasts", "judged", "back", "outcomes", "holds"} <= push.keys()
    assert {"effect", "low", "high", "p_value", "corrected", "default"} <= push["last"].keys()
    assert [one["kind"] for one in push["substitutes"]] == ["random units", "random directions", "actions"]


def test_evaluate_measures_only_what_is_named(map_path: Path) -> None:
    few = ("--seeds", "100", "--hold", 100, "--without-controls", "--json")
    result = run("evaluate", "ant", "--map", map_path, *few, "--behavior", "push")
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert [(row["behavior"], row["condition"]) for row in data["behaviors"]] == [("push", "undisturbed")]
    assert not data["behaviors"][0]["substitutes"]
    unknown = run("evaluate", "ant", "--map", map_path, *few, "--behavior", "hop")
    assert unknown.exit_code == 1
    assert "no behavior 'hop'; available: push, " in unknown.output


def test_evaluate_refuses_a_quick_look_at_anything_but_behaviors(map_path: Path) -> None:
    refused = run("evaluate", "ant", "--map", map_path, "--policy-only", "--quick")
    assert refused.exit_code == 2
    assert "--policy-only and --quick are mutually exclusive" in refused.output


def test_evaluate_refuses_to_watch_without_a_terminal_before_it_runs(map_path: Path) -> None:
    refused = run("evaluate", "ant", "--map", map_path, "--watch")
    assert refused.exit_code == 1
    assert "pdtui: the screen needs a terminal" in refused.output
    assert "control steps" not in refused.output


def test_evaluate_measures_a_target_and_the_policy_alone(map_path: Path) -> None:
    tracked = run("evaluate", "ant", "--map", map_path, "--seeds", "100", "--target", "yaw", "--json")
    data = json.loads(tracked.output)
    assert [row["target"] for row in data["targets"]][:4] == [0.0, 0.4, 0.9, 1.2]
    assert data["default_outcomes"].keys() == data["outcomes"].keys() == {"fell"}
    walked = run("evaluate", "ant", "--map", map_path, "--seeds", "100", "--policy-only", "--json")
    assert json.loads(walked.output)["steps"] == 1000
    missing = run("evaluate", "ant", "--map", map_path, "--seeds", "100", "--target", "height")
    assert "no behavior of mode pid holds 'height'; held are: yaw" in missing.output


def test_bench_prints_all_parts(map_path: Path) -> None:
    result = run("bench", "loop", "ant", "--map", map_path, "--steps", 100, "--json")
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    rates = {"bare", "policy", "stimulated", "recorded", "recorded_share"}
    assert rates | {"forward_us", "added_us", "imprinted_us"} == data.keys()
    assert all(value > 0 for value in data.values())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["drive", "qqqqqqqq"], "pdtui: unknown robot 'qqqqqqqq'; available: a1, a1-vision"),
        (["drive", "ant", "--map", "nowhere.toml"], "pdtui: nowhere.toml: no such map"),
        (
            ["drive", "ant", "--map", "MAP"],
            "pdtui: the screen needs a terminal; use --headless to drive without one",
        ),
        (["drive", "ant", "--map", "MAP", "--keys", "KEYS"], "pdtui: --keys needs --headless"),
        (
            ["drive", "ant", "--map", "MAP", "--headless", "--policy", "no.safetensors"],
            "pdtui: no policy 'no.safe",
        ),
        (["drive", "ant", "--map", "MAP", "--headless", "--keys", "no.txt"], "pdtui: no.txt: cannot be read"),
        (["drive", "ant", "--map", "MAP", "--headless", "--keys", "BAD"], "bad.txt:2: expected 'STEP KEY'"),
        (["drive", "ant", "--map", "MAP", "--headless", "--record", "FOLDER"], "pdtui: "),
        (["drive", "ant", "--map", "MAP", "--headless", "--record", "KEYS"], "keys.txt: already exists"),
        (["dissect", "ant", "-o", "KEYS"], "keys.txt: already exists; --overwrite replaces it"),
        (
            ["dissect", "ant", "--set", "window=kaiser", "-o", "OUT"],
            "setting 'window': expected blackman|hann",
        ),
        (["dissect", "ant", "--set", "color", "-o", "OUT"], "setting 'color': expected NAME=VALUE"),
        (["replay", "no.rrd"], "pdtui: no.rrd"),
        (["replay", "KEYS"], "keys.txt"),
        (["dissect", "ant", "--policy", "no.safetensors", "-o", "OUT"], "pdtui: no policy 'no.safetensors'"),
        (["evaluate", "ant", "--map", "MAP", "--seeds", "9-3"], "'9-3': expected seeds such as 7 or 100-119"),
    ],
)
def test_a_mistake_is_one_line_and_a_code(
    arguments: list[str], message: str, map_path: Path, keys: Path, tmp_path: Path
) -> None:
    (tmp_path / "bad.txt").write_text("1 w\noops\n")
    places = {"MAP": map_path, "KEYS": keys, "BAD": tmp_path / "bad.txt", "FOLDER": tmp_path}
    places["OUT"] = tmp_path / "out.toml"
    result = run(*(places.get(argument, argument) for argument in arguments))
    assert result.exit_code != 0
    assert message in result.output
    assert "Traceback" not in result.output
    assert not isinstance(result.exception, AttributeError | TypeError | KeyError)


def test_an_unwritable_recording_is_named(map_path: Path, tmp_path: Path) -> None:
    blocked = tmp_path / "file" / "out.rrd"
    blocked.parent.write_text("a file where a folder should be")
    result = run("drive", "ant", "--map", map_path, "--headless", "--record", blocked, "--steps", 5)
    assert result.exit_code == 1
    assert f"pdtui: {blocked}" in result.output


def test_a_map_of_another_policy_needs_force(
    map_path: Path, small_map: StimulationMap, tmp_path: Path
) -> None:
    text = small_map.text.replace(small_map.policy_hash, "0" * 64)
    other = tmp_path / "other.toml"
    other.write_text(text)
    refused = run("drive", "ant", "--map", other, "--headless", "--steps", 5)
    assert refused.exit_code == 1
    assert f"made for a policy with SHA-256 {'0' * 64}" in refused.output
    assert (
        run("drive", "ant", "--map", other, "--headless", "--steps", 5, "--no-record", "--force").exit_code
        == 0
    )
    for command in (
        ("evaluate", other, "--update", "--force", "--seeds", "100"),
        ("tune", other, "--all", "--force", "--seeds", "200-201", "--points", 1, "--refinements", 0),
    ):
        result = run(*command)
        assert result.exit_code == 1
        assert result.output.startswith("pdtui: --")
        assert "another policy" in result.output
        assert result.output.count("\n") == 1
    assert other.read_text() == text


def test_a_robot_without_a_map_is_driven_by_its_policy_alone(tmp_path: Path) -> None:
    policy = Path(__file__).parent / "fixtures" / "sb3-pendulum.zip"
    keys, session = tmp_path / "keys.txt", tmp_path / "out.rrd"
    keys.write_text("5 space\n12 r\n")
    drive = ("drive", "Pendulum-v1", "--headless", "--steps", 20, "--keys", keys, "--record", session)
    refused = run(*drive)
    assert refused.exit_code == 1
    assert "no map 'Pendulum-v1'" in refused.output
    alone = run(*drive, "--policy", policy)
    assert alone.exit_code == 0, alone.output
    assert "no map 'Pendulum-v1'" in alone.stderr
    assert "driving without behaviors" in alone.stderr
    assert "steps with a key 2" in alone.stdout
    assert "identical: 20 steps" in run("replay", session).output
    measured = run("evaluate", "Pendulum-v1", "--policy", policy, "--seeds", "1", "--workers", 1)
    assert measured.exit_code == 1
    assert "no map 'Pendulum-v1'" in measured.output


def test_a_divergence_is_one_line_and_leaves_the_session(
    map_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pdtui.robots.ant import Ant
    from pdtui.sessions.session_reader import read_session

    whole = Ant.step

    def kicked(self: Ant, action: object) -> object:
        self.data.qvel[:] += 1e8 * (self.data.time > 0.5)
        return whole(self, action)  # type: ignore[arg-type]

    monkeypatch.setattr(Ant, "step", kicked)
    session = tmp_path / "diverged.rrd"
    result = run("drive", "ant", "--map", map_path, "--headless", "--record", session, "--steps", 50)
    assert result.exit_code == 1
    assert "the simulation diverged at" in result.output
    assert "the simulation diverged at" in read_session(session).outcome


def test_importing_the_commands_pulls_in_nothing_heavy() -> None:
    heavy = "torch", "mujoco", "gymnasium", "rerun", "scipy", "textual", "jax", "pyarrow"
    code = (
        "import sys; from pdtui.cli import COMMANDS, main; [main.get_command(None, n) for n in COMMANDS];"
        f"print([m for m in {heavy!r} if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_the_list_of_commands_loads_none_of_them() -> None:
    code = (
        "import sys; from pdtui.cli import main; main(['--help'], standalone_mode=False);"
        "print([m for m in sys.modules if m.endswith(('_command', 'shared_options'))])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip().endswith("\n[]")
    assert isinstance(main, LazyCommandGroup)
    for name in COMMANDS:
        command = main.get_command(click.Context(main), name)
        assert command is not None
        assert command.name == name


def test_optional_rooms_can_be_deleted(map_path: Path, tmp_path: Path) -> None:
    names = [room.removeprefix("pdtui.") for room in OPTIONAL_ROOMS]
    shutil.copytree(
        Path(pdtui.__file__).parent, tmp_path / "pdtui", ignore=shutil.ignore_patterns("__pycache__", *names)
    )

    def run_copy(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "pdtui", *map(str, arguments)],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(tmp_path)},
            capture_output=True,
            text=True,
            check=False,
        )

    session = tmp_path / "sessions" / "a.rrd"
    working: list[tuple[str | Path, ...]] = [
        ("--help",),
        ("drive", "ant", "--map", map_path, "--headless", "--steps", "5", "--record", session),
        ("sessions", "list"),
        ("evaluate", "ant", "--help"),
    ]
    for line in working:
        done = run_copy(*line)
        assert done.returncode == 0, done.stderr
    assert "a.rrd" in run_copy("sessions", "list").stdout
    refused: list[tuple[str, tuple[str | Path, ...]]] = [
        ("paper", ("evaluate", "ant", "--map", map_path, "--experiment", "forest")),
        ("training", ("train", "ant")),
        ("benchmarks", ("bench", "loop", "ant", "--map", map_path)),
        ("study", ("study", "matching", "--list")),
    ]
    for room, line in refused:
        done = run_copy(*line)
        assert done.returncode == 1
        assert done.stderr == (
            f"pdtui: pdtui.{room} is not part of this installation, and the command needs it\n"
        )


@pytest.mark.viewer
def test_a_drive_is_shown_in_a_viewer_and_goes_on_without_one(
    map_path: Path, keys: Path, tmp_path: Path, viewer: RealViewer
) -> None:
    drive = ("drive", "ant", "--map", map_path, "--headless", "--keys", keys, "--steps", 80)
    before = {recording.store_id for recording in viewer.client.get_state().recordings}
    shown = run(*drive, "--record", tmp_path / "shown.rrd", "--viewer", viewer.port)
    assert shown.exit_code == 0, shown.output
    viewer.wait_for(
        lambda state: (
            state.active_recording not in {None, *before}
            and any(view.name.startswith("All activations") for view in state.views)
        )
    )
    assert not is_blank(viewer.picture("driven", step=60))
    nobody = free_port()
    alone = run(*drive, "--record", tmp_path / "alone.rrd", "--viewer", nobody)
    assert alone.exit_code == 0, alone.output
    assert f"no viewer listens on 127.0.0.1:{nobody}: start `rerun --bind 127.0.0.1" in alone.output
    assert "80 steps" in alone.output
    refused = run(*drive, "--no-record", "--viewer", nobody)
    assert "--viewer shows the recording" in refused.output


def test_robots_and_maps_are_listed(map_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "maps").mkdir()
    shutil.copy(map_path, tmp_path / "maps" / "mine.toml")
    (tmp_path / "maps" / "broken.toml").write_text("schema = 1\n")
    robots = {row["name"]: row for row in json.loads(run("robots", "--json").output)["robots"]}
    assert robots["bipedal_walker"]["starts"] == ["split"]
    assert {"ant", "ant-imprints", "mine"} <= set(robots["ant"]["maps"])
    listed = run("robots").output
    row = next(line for line in listed.splitlines() if line.startswith("walker "))
    assert row.split()[-2:] == ["walker-imprints,", "walker"]
    maps = {row["map"]: row for row in json.loads(run("maps", "--json").output)["maps"]}
    assert maps["mine"]["behaviors"]["push"] == "w"
    assert "broken.toml" in maps["broken"]["problem"]
    assert "push (w), twitch (t), hold heading (h)" in run("maps").output


@pytest.mark.parametrize("command", [[], *([name] for name in COMMANDS), ["sessions", "export"]])
def test_h_is_help(command: list[str]) -> None:
    short, long = run(*command, "-h"), run(*command, "--help")
    assert short.exit_code == 0
    assert short.output == long.output
    assert "-h, --help" in short.output
