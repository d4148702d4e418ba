"""The control-precision experiment: who follows, what is compared, and the pictures of it."""

from __future__ import annotations

import json
import shutil
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from pdtui.cli import main
from pdtui.core.errors import MapError
from pdtui.core.outcome import Outcome
from pdtui.driving.drive_config import DriveConfig
from pdtui.paper.heading_precision import compare_heading_precision, paired_error_ratio
from pdtui.paper.tracking_experiment import heading_precision_table
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.policies.weights.policy_loading import load_any_network
from pdtui.search.gains.tracking_drives import (
    STEPS_EACH,
    TrackingDriveJob,
    TrackingDriveResult,
    TrackingDriveRunner,
)
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map
from tests.real_viewer import RealViewer, is_blank
from tests.turning_robot import turning_loop

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "anymal_tanh.npz"
CHOICES = ImportOptions("tanh", "none", "none")
MAP = """
schema = 1
robot = "anymal"
[policy]
name = "anymal_tanh.npz"
sha256 = "{sha256}"
activation = "tanh"
squash = "none"
normalizer = "none"
[[behaviors]]
name = "by command"
key = "c"
mode = "pid"
commands = {{"yaw rate" = 1.0}}
pid = {{attribute = "yaw", kp = 1.5, ki = 0.0, kd = 0.0, limit = 1.0, step = 0.2}}
[[behaviors]]
name = "by unit"
key = "h"
mode = "pid"
magnitudes = {{"0:121" = 1.0}}
pid = {{attribute = "yaw", kp = 20.0, ki = 0.01, kd = 0.0, limit = 3.5, step = 0.2}}
"""


def _followed(seed: int, errors: list[float]) -> TrackingDriveResult:
    table = np.array([errors])
    outcome = Outcome.FELL if np.isnan(table).any() else None
    return TrackingDriveResult(TrackingDriveJob("yaw", "hold", seed, (0.0,)), -table, table, (), outcome)


@pytest.mark.skipif(not REFERENCE.is_file(), reason="the paper authors' weights (../shared) are not here")
def test_a_unit_steers_the_authors_policy_as_its_command_does(tmp_path: Path) -> None:
    shutil.copy(REFERENCE, tmp_path)
    path = tmp_path / "authors.toml"
    path.write_text(MAP.format(sha256=load_any_network(REFERENCE, CHOICES, None)[1]))
    result = compare_heading_precision([DriveConfig("anymal", load_map(path), 0)], [100], targets=(0.0, 0.4))
    command, unit = result.rows
    assert (command.input_kind, command.inputs, command.other_commands) == (
        "command",
        ("yaw rate",),
        {"forward": 1.0, "lateral": 0.0},
    )
    assert (unit.input_kind, unit.inputs, unit.other_commands["yaw rate"]) == ("units", ("0:121",), 0.0)
    assert command.ratio is None
    assert unit.ratio is not None
    assert unit.ratio.value == pytest.approx(unit.tracking.error / command.tracking.error)
    for row in result.rows:
        assert row.tracking.outcomes == {Outcome.FELL: 0}
        assert row.headings.shape == (1, 2 * STEPS_EACH)
        assert row.headings[0, -1] == pytest.approx(0.4, abs=0.1)
        assert row.tracking.error == pytest.approx(
            np.abs(row.headings[0] - np.repeat([0.0, 0.4], STEPS_EACH)).mean()
        )


def test_pushes_disturb_both_controllers() -> None:
    config = DriveConfig("anymal", load_map(find_map("anymal")), 0)
    result = compare_heading_precision([config], [5000], targets=(0.0, 0.4), pushed=True)
    kinds = [(row.input_kind, *row.inputs) for row in result.rows]
    assert kinds[1:] == [("interventions", "one direction of layer 0"), ("command", "yaw rate")]
    assert kinds[0][0] == "units"
    for row in result.rows:
        assert row.pushed is not None
        assert row.pushed.tracking.seeds == (5000,)
        # Without a push it would be the same drive, to the last bit.
        assert row.pushed.tracking.error != row.tracking.error
    units, _, command = (row.pushed for row in result.rows)
    assert units is not None
    assert command is not None
    assert units.ratio is not None
    assert units.ratio.value == pytest.approx(units.tracking.error / command.tracking.error)
    console = Console(width=160, record=True, file=StringIO())
    console.print(heading_precision_table(result))
    assert "pushed, seed 5000" in console.export_text()
    assert result.as_dict()["rows"][0]["pushed"]["tracking"]["error"] == units.tracking.error
    assert compare_heading_precision([config], [5000], targets=(0.0,)).rows[0].pushed is None


def test_a_drive_counts_until_its_fall() -> None:
    with TrackingDriveRunner(turning_loop(kp=20.0, limit=4.0)) as runner:
        fell, held = runner.run(
            [TrackingDriveJob("yaw", name, 100, (0.0, 1.2, 0.0)) for name in ("hold heading", "")]
        )
    assert (fell.outcome, held.outcome) == (Outcome.FELL, None)
    known = np.isfinite(fell.errors.ravel())
    assert 0 < known.sum() < 3 * STEPS_EACH
    assert not known[known.sum() :].any()
    assert fell.error == pytest.approx(np.abs(fell.errors.ravel()[known]).mean())
    assert np.isnan(fell.responses[0].rise)


def test_ratios_are_paired_by_seed() -> None:
    rng = np.random.default_rng(3)
    base = rng.uniform(0.05, 0.5, 12)
    command = [_followed(seed, [error]) for seed, error in enumerate(base)]
    units = [_followed(seed, [1.2 * error]) for seed, error in enumerate(base)]
    ratio = paired_error_ratio(units, command)
    # Unpaired, the spread of the seeds would make it wide.
    assert (ratio.value, ratio.low, ratio.high) == pytest.approx((1.2, 1.2, 1.2))
    lost = paired_error_ratio([_followed(12, [np.nan]), *units], [_followed(12, [9.0]), *command])
    assert lost.value == pytest.approx(1.2)
    assert paired_error_ratio(units[:1], command[:1]).high == np.inf


def test_a_map_without_a_heading_to_hold_is_named(map_text: str, tmp_path: Path) -> None:
    path = tmp_path / "other.toml"
    path.write_text(map_text.replace('attribute = "yaw"', 'attribute = "speed"'))
    with pytest.raises(MapError, match=r"other.toml: no behavior of mode pid holds 'yaw'; held are: speed"):
        compare_heading_precision([DriveConfig("ant", load_map(path), 0)], [100])


@pytest.mark.viewer
def test_the_command_compares_maps_and_draws(map_path: Path, tmp_path: Path, viewer: RealViewer) -> None:
    other, picture, recording = tmp_path / "other.toml", tmp_path / "f.png", tmp_path / "f.rrd"
    other.write_text(map_path.read_text().replace("kp = 2.0", "kp = 4.0"))
    line = ["evaluate", str(map_path), str(other), "--experiment", "tracking", "--seeds", "100", "--json"]
    line += ["--workers", "1", "-o", str(picture), "-o", str(recording)]
    result = CliRunner().invoke(main, line)
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert [Path(row["map"]).name for row in data["rows"]] == ["small.toml", "other.toml"]
    assert data["targets"][:4] == [0.0, 0.4, 0.9, 1.2]
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    viewer.show(recording)
    assert set(viewer.view_names()) == {
        "Heading (rad), mean and middle 90 % of 1 seeds",
        "Mean |error| (rad) of 1 seeds",
        "Figures",
    }
    assert not is_blank(viewer.picture("tracking"))
    again = CliRunner().invoke(main, line)
    assert again.exit_code == 1
    assert "f.png: already exists; --overwrite replaces it" in again.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["evaluate", "MAP", "MAP"], "more than one map needs --experiment"),
        (["evaluate", "MAP", "-o", "f.png"], "-o needs --experiment"),
        (["evaluate", "MAP", "--experiment", "tracking", "--policy-only"], "are mutually exclusive"),
        (["evaluate", "MAP", "--experiment", "commands", "-o", "f.png"], "commands draws no pictures"),
        (["evaluate", "MAP", "--experiment", "forest", "-o", "f.png"], "forest draws no pictures"),
        (["evaluate", "MAP", "MAP", "--experiment", "forest"], "--experiment forest takes one map"),
        (["evaluate", "MAP", "--experiment", "tracking", "--repeats", "2"], "has no option --repeats"),
        (["evaluate", "MAP", "--experiment", "tracking", "--journal", "f"], "has no option --journal"),
        (["evaluate", "MAP", "--policy-only", "--journal", "f"], "are mutually exclusive"),
        (["evaluate", "MAP", "--update", "--policy-only"], "are mutually exclusive"),
        (["evaluate", "MAP", "--experiment", "tracking", "-o", "f.gif"], "f.gif: expected a name that ends"),
        (["tune", "MAP"], "expected either a BEHAVIOR or --all"),
        (["tune", "nowhere", "--all"], "no map 'nowhere'"),
        (["tune", "MAP", "hop"], "no behavior 'hop'; of mode pid are: hold heading"),
        (["tune", "MAP", "push"], "behavior 'push': expected mode pid, found fixed"),
        (["tune", "MAP", "--all", "--seeds", "2000"], "expected at least 2 seeds"),
    ],
)
def test_a_wrong_line_is_answered_in_one(map_path: Path, arguments: list[str], message: str) -> None:
    result = CliRunner().invoke(main, [str(map_path) if one == "MAP" else one for one in arguments])
    assert result.exit_code != 0
    assert message in result.output.replace("\n", " ")


def test_tune_writes_only_what_is_better(map_path: Path, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(map_path.read_text())
    line = ["tune", str(path), "hold heading", "--seeds", "2000-2001", "--points", "2", "--refinements", "0"]
    result = CliRunner().invoke(main, [*line, "--workers", "1", "--json"])
    assert result.exit_code == 0, result.output
    (found,) = json.loads(result.output)["behaviors"]
    pid = load_map(path).behaviors["hold heading"].pid
    assert pid is not None
    kept = found["trials"][found["kept"]]["pid"]
    assert found["gains"] == kept
    assert found["better"] == (found["kept"] != "map")
    assert (pid.kp, pid.ki, pid.kd, pid.limit) == tuple(kept[name] for name in ("kp", "ki", "kd", "limit"))
    assert (path.read_text() == map_path.read_text()) != found["better"]
