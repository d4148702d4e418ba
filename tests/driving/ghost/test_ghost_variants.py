"""Ghosts that are another map, policy or magnitude: each is that other drive, to the last bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.core.attributes import Floats
from pdtui.core.drive_events import DriveEvent
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.ghost.ghost_variant import GhostVariant
from pdtui.driving.loop_builder import build_control_loop
from pdtui.stimulation.map_library import map_without_behaviors
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.driving.ghost.ghost_drives import ghost_drive
from tests.small_map import write_small_weights


def drive_alone(config: DriveConfig, events: dict[int, list[DriveEvent]], steps: int) -> Floats:
    """Attributes of a drive without a ghost, shape (S, J)."""
    loop = build_control_loop(config)
    return np.array([loop.advance(events.get(step, ())).attributes for step in range(steps)])


def test_a_ghost_with_the_same_magnitudes_is_the_drive_and_one_with_others_is_not(
    small_map: StimulationMap,
) -> None:
    config = DriveConfig("ant", small_map, 3)
    for factor in (1.0, 0.5):
        variant = GhostVariant(f"× {factor:g}", factor=factor)
        with ghost_drive(replace(config, ghost=variant)) as drive:
            drive.run(5)
            drive.run(10, "w")
            drive.run(5, "plus")
            ghost = drive.catch_up()
            rows = np.array(drive.ghost_rows)
        assert (ghost.first, ghost.label) == (5, variant.label)
        events = {
            5: [DriveEvent(5, "behavior", "push"), DriveEvent(5, "factor", "push", factor)],
            15: [DriveEvent(15, "factor", "push", 1.25 * factor)],
        }
        np.testing.assert_array_equal(rows, drive_alone(config, events, 20)[5:])
        assert ghost.latest is not None
        same = np.array_equal(ghost.latest.attributes, ghost.latest.drive_attributes)
        assert same == (factor == 1.0)


def test_a_ghost_of_another_map_has_its_behaviors_on_the_same_keys(small_map: StimulationMap) -> None:
    push, twitch = small_map.behaviors["push"], small_map.behaviors["twitch"]
    shove = replace(twitch, name="shove", key=push.key, together=(), period=None)
    other = replace(small_map, behaviors={"shove": shove})
    config = DriveConfig("ant", small_map, 3)
    variant = GhostVariant("other", replace(config, stimulation_map=other))
    with ghost_drive(replace(config, ghost=variant)) as drive:
        assert drive.wait_for("waiting").first == -1
        drive.run(5)  # it begins at once, as its policy may be another
        drive.run(15, "w")
        ghost = drive.catch_up()
        rows = np.array(drive.ghost_rows)
    assert ghost.first == 5
    events = {5: [DriveEvent(5, "behavior", "shove")]}
    np.testing.assert_array_equal(
        rows[-15:], drive_alone(replace(config, stimulation_map=other), events, 20)[5:]
    )


def test_a_ghost_of_another_policy_runs_from_where_it_is_turned_on(
    small_map: StimulationMap, tmp_path: Path
) -> None:
    write_small_weights(tmp_path / "other.safetensors", layers=(8,))
    alone = map_without_behaviors("ant", str(tmp_path / "other.safetensors"))
    other = DriveConfig("ant", alone, 3)
    with ghost_drive(DriveConfig("ant", small_map, 3, ghost=GhostVariant("other", other))) as drive:
        drive.run(15)
        ghost = drive.catch_up()
    assert ghost.first == 0
    np.testing.assert_array_equal(drive.ghost_rows, drive_alone(other, {}, 15))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--ghost-map", "nope"], "no map 'nope'"),
        (["--ghost-factor", "2", "--ghost-map", "ant"], "--ghost-factor is about the drive's own behaviors"),
        (["--ghost-map", "walker"], "made for robot 'walker', not for 'ant'"),
    ],
)
def test_what_cannot_be_a_ghost_is_refused_before_the_drive(options: list[str], said: str) -> None:
    result = CliRunner(env={"COLUMNS": "200"}).invoke(main, ["drive", "ant", "--no-record", *options])
    assert result.exit_code != 0
    assert said in " ".join(result.output.split())
