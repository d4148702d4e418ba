"""Learning dynamics: checkpoints are measured once, and correlations are as computed independently."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from scipy import stats

from pdtui.cli import main
from pdtui.core.errors import StudyError
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.weights_file import CHECKPOINT_FOLDER, load_network, save_network
from pdtui.study.dynamics.learning_dynamics import (
    CheckpointMeasurement,
    LearningDynamics,
    correlate_course,
    list_checkpoints,
)

NOISES = (2.0, 0.5, 0.1, 0.02, 0.0)


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the Walker that becomes the shipped policy: its weights with ever less noise."""
    folder = tmp_path_factory.mktemp("run")
    generator = torch.Generator().manual_seed(0)
    for number, noise in enumerate(NOISES):
        network = load_network(find_weights_file("walker"))
        with torch.no_grad():
            for weights in network.parameters():
                weights.add_(noise * weights.std() * torch.randn(weights.shape, generator=generator))
        save_network(folder / CHECKPOINT_FOLDER / f"{number * 1000:010d}.safetensors", network)
    return folder


def _run(*arguments: str) -> str:
    result = CliRunner(env={"COLUMNS": "200"}).invoke(main, list(arguments))
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(scope="module")
def summary(run_folder: Path) -> dict[str, Any]:
    printed = _run("dynamics", "walker", str(run_folder), "--every", "2", "--json")
    runs: list[dict[str, Any]] = json.loads(printed)["runs"]
    assert len(runs) == 1
    return runs[0]


def test_the_course_ends_with_the_shipped_policy(summary: dict[str, Any]) -> None:
    first, *_, last = summary["checkpoints"]
    assert [one["steps"] for one in summary["checkpoints"]] == [0, 2000, 4000]
    assert last["success"] == 1.0
    assert first["mean_return"] < 100 < last["mean_return"]
    assert len(last["discrepancies"]) == len(summary["primitives"]) > 3
    known = [value for value in last["normalized_discrepancies"] if value is not None]
    assert all(0 <= value <= 1 for value in known)


def test_what_was_measured_is_not_measured_again_and_is_drawn(
    run_folder: Path, summary: dict[str, Any], tmp_path: Path
) -> None:
    journal = run_folder / "dynamics.jsonl"
    before = journal.read_bytes()
    pictures = [tmp_path / f"course.{kind}" for kind in ("png", "svg", "rrd")]
    options = [part for path in pictures for part in ("-o", str(path))]
    printed = _run("dynamics", "walker", str(run_folder), "--every", "2", *options)
    assert "discrepancy and return" in printed
    assert journal.read_bytes() == before
    assert all(path.stat().st_size > 10_000 for path in pictures)


def test_a_folder_without_checkpoints_is_refused(tmp_path: Path) -> None:
    result = CliRunner(env={"COLUMNS": "200"}).invoke(main, ["dynamics", "walker", str(tmp_path)])
    assert result.exit_code == 1
    assert "expected at least 3 checkpoints of `pdtui train --checkpoints`, found 0" in result.stderr
    with pytest.raises(StudyError, match="found 0"):
        list_checkpoints(tmp_path, 1)


def test_every_nth_checkpoint_includes_the_last(tmp_path: Path) -> None:
    (tmp_path / CHECKPOINT_FOLDER).mkdir()
    for steps in range(0, 110, 10):
        (tmp_path / CHECKPOINT_FOLDER / f"{steps:010d}.safetensors").touch()
    assert [int(path.stem) for path in list_checkpoints(tmp_path, 3)] == [10, 40, 70, 100]


def test_discrepancies_are_normalized_for_each_attribute() -> None:
    nan = float("nan")
    rows = [(nan, 8.0), (3.0, 6.0), (2.0, 4.0), (1.0, 0.0)]
    run = LearningDynamics(
        "run",
        "walker",
        ("vx", "pitch"),
        ("0:1", "1:2"),
        tuple(
            CheckpointMeasurement(10 * number, float(number), 1.0, row, row, row, row)
            for number, row in enumerate(rows)
        ),
    )
    np.testing.assert_allclose(
        run.normalized_discrepancies(), [[nan, 1.0], [1.0, 0.75], [0.5, 0.5], [0.0, 0.0]]
    )
    found = run.correlate_with_discrepancy(run.returns)
    assert found.value == pytest.approx(stats.spearmanr([1.0, 0.875, 0.5, 0.0], [0, 1, 2, 3]).statistic)
    assert np.isnan(run.correlate_with_discrepancy(run.success).value)  # it does not vary


def test_the_interval_of_a_course_holds_for_independent_noise_and_is_wide_for_a_trend() -> None:
    rng = np.random.default_rng(1)
    covered = []
    for _ in range(60):
        found = correlate_course(rng.normal(size=30), rng.normal(size=30))
        assert found.low <= found.value <= found.high
        covered.append(found.low <= 0.0 <= found.high)
    assert np.mean(covered) > 0.8
    trend = np.arange(30.0)
    falling = correlate_course(-trend + rng.normal(size=30), trend)
    assert falling.high < 0.0


@pytest.mark.slow  # trains for about a minute
def test_a_training_run_is_followed_from_its_start(tmp_path: Path) -> None:
    pytest.importorskip("jax", reason="the extra 'train' is not installed")
    folder = tmp_path / "walker-32"
    _run(
        *("train", "walker", "--layers", "32,32", "--seed", "1000", "--steps", "102400"),
        *("--checkpoints", "--folder", str(folder)),
    )
    printed = _run("dynamics", "walker", str(folder), "--every", "10", "--json")
    [run] = json.loads(printed)["runs"]
    steps = [one["steps"] for one in run["checkpoints"]]
    assert (steps[0], steps[-1], len(steps)) == (0, 102400, 6)
    assert run["checkpoints"][-1]["mean_return"] > 2 * run["checkpoints"][0]["mean_return"]
    found = run["correlations"]["discrepancy and return"]
    assert found["low"] <= found["value"] <= found["high"]
