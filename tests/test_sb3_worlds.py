"""Policies that Stable-Baselines3 trained, end to end: dissect, evaluate on unseen seeds, drive, replay."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import evaluate_behaviors, plan_evaluation
from pdtui.evaluation.protocol_settings import ProtocolSettings
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.map_policy_lookup import resolve_map_policy
from pdtui.stimulation.map_reader import load_map

FIXTURES = Path(__file__).parent / "fixtures"
WORLDS = {"Pendulum-v1": "sb3-pendulum", "Hopper-v5": "sb3-hopper", "HalfCheetah-v5": "sb3-halfcheetah"}


def run(*arguments: str | Path | int) -> str:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


def strict(text: str) -> Any:
    def refuse(name: str) -> NoReturn:
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.mark.parametrize(
    "env", ["Pendulum-v1", *(pytest.param(env, marks=pytest.mark.slow) for env in list(WORLDS)[1:])]
)
def test_a_policy_is_dissected_measured_driven_and_replayed(env: str, tmp_path: Path) -> None:
    path, session, keys = tmp_path / "x.toml", tmp_path / "s.rrd", tmp_path / "keys.txt"
    statistics = FIXTURES / f"{WORLDS[env]}-normalizer.npz"
    normalizer: list[str | Path] = ["--normalizer", statistics] if statistics.exists() else []
    policy = FIXTURES / f"{WORLDS[env]}.zip"
    found = strict(
        run("dissect", "--env", env, "--policy", policy, *normalizer, "--quick",
            "--budget", "0.001", "--workers", 2, "-o", path, "--json")
    )  # fmt: skip
    assert "reward" not in found["movable"]
    stimulation_map = load_map(path)
    assert stimulation_map.robot == env
    behaviors = list(stimulation_map.behaviors.values())
    assert stimulation_map.primitives or behaviors

    config = DriveConfig(env, resolve_map_policy(stimulation_map), 0)
    few = ProtocolSettings(hold_steps=200, hold_seconds=0.0, window_seconds=1.0, draws=0, condition_seeds=0)
    plan = plan_evaluation(config, range(100, 105), few)
    measured = evaluate_behaviors(config, plan, workers=2).behaviors
    aimed = {one.name: one.aim for one in behaviors if one.aim is not None}
    assert [one.behavior for one in measured] == list(aimed)
    if env == "Hopper-v5":
        assert measured, "a hopper's leg is easily moved"
    signs = [np.sign(one.first.effect) == aimed[one.behavior].sign for one in measured]
    assert sum(signs) >= 0.5 * len(signs), measured

    pressed = [one.key for one in behaviors][:3]
    keys.write_text("".join(f"{20 * number + 10} {key}\n" for number, key in enumerate(pressed)))
    run("drive", path, "--headless", "--keys", keys, "--steps", 100, "--record", session)
    assert run("replay", session) == "identical: 100 steps\n"
    assert [event.key for event in read_session(session).events] == pressed
