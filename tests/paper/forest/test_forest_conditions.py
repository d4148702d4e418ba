"""The forest: what counts of a drive, saved and scored again, whoever drove."""

from __future__ import annotations

import json
import multiprocessing
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from pdtui.cli import main
from pdtui.core.errors import MapError, PdtuiError, SessionError, WorkerError
from pdtui.core.outcome import Outcome
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import drive_headless
from pdtui.driving.keystrokes import read_keystrokes
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import replay_session
from pdtui.paper.forest.forest_conditions import CONDITIONS, PERSON, REPEATS, evaluate_forest
from pdtui.paper.forest.forest_episode import (
    ForestEpisodeScore,
    drive_forest_episode,
    read_forest_episode,
    record_forest_episode,
)
from pdtui.paper.forest.forest_results import compare_conditions
from pdtui.paper.forest.key_motion_model import KeyMotionModel
from pdtui.paper.forest.key_pressers import OperatorPresser, PlaceboPresser
from pdtui.paper.forest.scripted_operator import DEFAULT
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.policies.weights.weights_header import hash_file
from pdtui.sessions.session_reader import read_session
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_reader import load_map
from tests.deadline import deadline

pytest.importorskip("pybullet", reason="PyBullet is not installed (it has no wheels for this Python)")

A1_MAP = """\
schema = 1
robot = "a1"
policy = {{ name = "{policy}", sha256 = "{sha256}" }}
keys = {{ default = "space" }}
"""
BEHAVIOR = """
[[behaviors]]
name = "{name}"
key = "{key}"
says = "does something"
magnitudes = {{ "0:3" = {value} }}
"""
QUICK = ((7,), 450)
SWAY = KeyMotionModel(0.5, 1.0, 0.1, 6.0, 0.8, 0.0, 0.2, 0.0)
KEY_MODELS = {
    DEFAULT: KeyMotionModel(0.0, 1.4, 0.1, 6.0, 0.8, 0.0, 0.2, 0.0),
    "left": SWAY,
    "right": KeyMotionModel(-0.5, 1.0, 0.1, 6.0, 0.8, 0.0, 0.2, 0.0),
    "stop": KeyMotionModel(0.0, 1.0, 0.1, 0.1, 0.8, 0.0, 0.2, 0.0),
}
"""What the operator is told, though this robot only stands: so it has reason to press keys."""


@pytest.fixture(scope="module")
def a1_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map and the policy that stands still, nearly."""
    folder = tmp_path_factory.mktemp("a1")
    spec = NetworkSpec("a1", 93, (8,), "tanh", 6, "tanh", (-1.0,) * 6, (1.0,) * 6)
    network = PolicyNetwork(spec)
    network.load_tensors(
        {name: tensor * 0 for name, tensor in network.state_dict().items()}
        | {"head.weight": network.head.weight.detach() * 0.02, "normalizer.std": network.normalizer.std}
    )
    weights = folder / "stands.safetensors"
    save_network(weights, network)
    text = A1_MAP.format(policy=weights, sha256=hash_file(weights))
    for name, key, value in (("left", "a", 3.0), ("right", "d", -3.0), ("stop", "s", 1.0)):
        text += BEHAVIOR.format(name=name, key=key, value=value)
    path = folder / "a1.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def config(a1_map: Path) -> DriveConfig:
    return DriveConfig("a1", load_map(a1_map), 0)


@pytest.fixture(scope="module")
def built(config: DriveConfig) -> ControlLoop:
    return build_control_loop(config)


def _loop(built: ControlLoop, seed: int) -> ControlLoop:
    return ControlLoop(built.robot, built.policy, built.map, seed, start="forest")


def _run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def recorded(built: ControlLoop, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive of the operator, of 120 steps."""
    path = tmp_path_factory.mktemp("drives") / "driven.rrd"
    loop = _loop(built, 505)
    record_forest_episode(loop, 120, OperatorPresser(loop, KEY_MODELS), path, "all")
    return path


def test_the_operators_drive_is_saved_like_a_persons(
    recorded: Path, built: ControlLoop, config: DriveConfig, tmp_path: Path
) -> None:
    session = read_session(recorded)
    assert session.keys > 0
    assert replay_session(recorded, strict=True).verdict == "identical: 120 steps"
    again = tmp_path / "again.rrd"
    loop = _loop(built, 505)
    presses = read_keystrokes(recorded.with_suffix(".keys"), config.stimulation_map)
    drive_headless(loop, presses, 120, SessionRecorder(again, loop.info))
    np.testing.assert_array_equal(read_session(again).digests, session.digests)
    with pytest.raises(SessionError, match=r"driven\.rrd: already exists"):
        record_forest_episode(loop, 10, OperatorPresser(loop, KEY_MODELS), recorded, "all")


def test_a_recorded_drive_scores_what_it_did(recorded: Path, built: ControlLoop) -> None:
    loop = _loop(built, 505)
    driven, events = drive_forest_episode(loop, 120, OperatorPresser(loop, KEY_MODELS))
    assert read_forest_episode(recorded, "a1", 1000) == (driven, "stands")
    assert driven.presses == len(events) == driven.pressed_steps > 0
    assert (driven.seed, driven.steps, driven.outcome) == (505, 120, Outcome.OUT_OF_TIME)
    session = read_session(recorded)
    shorter, _ = read_forest_episode(recorded, "a1", 50)
    assert shorter.steps == 50
    assert shorter.reward == pytest.approx(session.rewards[:50].sum())
    assert shorter.presses == sum(event.step < 50 for event in session.events)


def test_only_a_drive_of_the_forest_that_goes_on_is_scored(
    recorded: Path, config: DriveConfig, built: ControlLoop, tmp_path: Path
) -> None:
    plane, back = tmp_path / "plane.rrd", tmp_path / "back.rrd"
    loop = ControlLoop(built.robot, built.policy, built.map, 1)
    drive_headless(loop, {}, 5, SessionRecorder(plane, loop.info))
    with pytest.raises(SessionError, match="with start 'forest', found one of a1 with the usual start"):
        read_forest_episode(plane, "a1", 100)
    with pytest.raises(SessionError, match="expected a drive of ant with start 'forest', found one of a1"):
        read_forest_episode(recorded, "ant", 100)
    loop = _loop(built, 1)
    drive_headless(loop, {200: ["backspace"]}, 203, SessionRecorder(back, loop.info))
    with pytest.raises(SessionError, match="it was rewound at step 200"):
        read_forest_episode(back, "a1", 300)


def test_conditions_and_a_person_stand_in_one_table(
    config: DriveConfig, recorded: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "drives"
    result = evaluate_forest(
        config, [1, 2], repeats=2, steps=40, sessions=[recorded], record=folder, tried=QUICK, workers=1
    )
    alone, operated, placebo = result.conditions[:3]
    person = result.conditions[-1]
    assert [row.condition for row in result.conditions[:3]] == list(CONDITIONS.values())[:3]
    for driven, blind in zip(operated.runs, placebo.runs, strict=True):
        assert (blind.seed, blind.presses) == (driven.seed, driven.presses)
        assert sorted(blind.keys) == sorted(driven.keys)
    assert alone.falls == 0
    assert alone.fall_share == pytest.approx((0.0, 0.842), abs=1e-3)
    operated_over_alone = result.ratios[0]
    assert (operated_over_alone.condition, operated_over_alone.baseline) == (
        operated.condition,
        alone.condition,
    )
    assert operated_over_alone.distance.value == pytest.approx(
        operated.distance.mean / alone.distance.mean, nan_ok=True
    )
    assert (alone.presses.mean, alone.episodes, [run.seed for run in alone.runs]) == (0.0, 2, [1, 2])
    rewards = [run.reward for run in alone.runs]
    assert (alone.reward.mean, alone.reward.std) == pytest.approx((np.mean(rewards), np.std(rewards, ddof=1)))
    assert (person.condition, person.policy, person.episodes) == (PERSON, "stands", 1)
    assert person.runs[0] == read_forest_episode(recorded, "a1", 40)[0]
    assert sorted(path.name for path in folder.iterdir()) == [
        f"a1-forest-seed{seed}.{kind}" for seed in (1, 2) for kind in ("keys", "rrd")
    ]
    assert list(result.keys) == list(KEY_MODELS)
    assert json.loads(json.dumps(asdict(result)))["seeds"] == [1, 2]


def test_a_placebo_presses_the_same_keys_without_looking() -> None:
    keys = ("a", "d", "space", "a", "s")

    def pressed(seed: int) -> list[tuple[int, str]]:
        placebo = PlaceboPresser(keys, 50, seed)
        return [(step, key) for step in range(200) if (key := placebo.press(step))]

    first = pressed(3)
    assert first == pressed(3)
    assert first != pressed(4)
    for stretch in range(4):
        here = [key for step, key in first if step // 50 == stretch]
        assert sorted(here) == sorted(keys)
    assert len({tuple(key for step, key in first if step // 50 == stretch) for stretch in range(4)}) > 1
    assert not any(PlaceboPresser((), 50, 3).press(step) for step in range(100))


def test_ratios_pair_the_same_forests() -> None:
    def runs(distances: list[float], collisions: list[float]) -> list[ForestEpisodeScore]:
        return [
            ForestEpisodeScore(seed, 0.0, far, hits, Outcome.OUT_OF_TIME, 10, (), 0)
            for seed, (far, hits) in enumerate(zip(distances, collisions, strict=True))
        ]

    far, hits = np.linspace(5.0, 50.0, 12), np.linspace(1.0, 4.0, 12)
    ratios = compare_conditions(
        {"alone": runs([*far], [*hits]), "operator": runs([*(2.0 * far)], [*(0.5 * hits)])}, CONDITIONS
    )
    assert [(one.condition, one.baseline) for one in ratios] == [("state with an operator", "state alone")]
    for found, value in (
        (ratios[0].distance, 2.0),
        (ratios[0].collisions, 0.5),
        (ratios[0].collisions_per_meter, 0.25),
    ):
        # Unpaired, the spread of the forests would make it wide.
        assert (found.value, found.low, found.high) == pytest.approx((value, value, value))


def test_a_killed_worker_ends_the_experiment(config: DriveConfig) -> None:
    def kill_one(_done: int, _total: int) -> None:
        multiprocessing.active_children()[0].kill()

    with deadline(120), pytest.raises(WorkerError, match="forests of a1: .*killed by SIGKILL"):
        evaluate_forest(
            config, range(1, 7), repeats=2, steps=40, conditions=["alone"], workers=2, progress=kill_one
        )


def test_what_cannot_be_measured_is_named(config: DriveConfig) -> None:
    with pytest.raises(PdtuiError, match=f"3 seeds cannot be divided into {REPEATS} equal repeats"):
        evaluate_forest(config, [1, 2, 3])
    with pytest.raises(PdtuiError, match="seed 900: the operator's key models are fitted"):
        evaluate_forest(config, range(900, 905))
    lost = {"stop": config.stimulation_map.behaviors["stop"]}
    poorer = DriveConfig(
        "a1", type(config.stimulation_map)(**{**vars(config.stimulation_map), "behaviors": lost}), 0
    )
    with pytest.raises(MapError, match="missing: left, right; the map has stop"):
        evaluate_forest(poorer, range(5))


def test_the_command_scores_sessions_alone(recorded: Path, a1_map: Path, map_path: Path) -> None:
    line = ("evaluate", "a1", "--map", a1_map, "--experiment", "forest")
    scored = _run(*line, "--session", recorded, "--json")
    assert scored.exit_code == 0, scored.output
    (row,) = json.loads(scored.stdout)["conditions"]
    assert row["runs"] == json.loads(json.dumps([asdict(read_forest_episode(recorded, "a1", 1000)[0])]))
    table = _run(*line, "--session", recorded, "--session", recorded, "--steps", 60)
    assert "state with a person" in table.stdout
    missing = _run("evaluate", "a1", "--map", a1_map, "--steps", 60)
    assert (missing.exit_code, "needs --experiment" in missing.stderr) == (2, True)
    elsewhere = _run("evaluate", "ant", "--map", map_path, "--experiment", "forest")
    assert (elsewhere.exit_code, "ant: no start 'forest'" in elsewhere.stderr) == (1, True)
