"""Whole commands with ``--cluster auto`` find what they find on one machine."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch

import tests.local_cluster  # skips this file where Ray is missing
from pdtui.policies.weights.weights_file import load_network

pytestmark = pytest.mark.slow  # each command runs twice, and a cluster of this machine starts in 7 s

assert tests.local_cluster


def run_command(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "pdtui", *arguments],
        cwd=folder,
        env=os.environ | {"COLUMNS": "110", "PYTHONPATH": str(Path.cwd())},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return done.stdout


def test_evaluate_with_a_map_and_weights_in_the_users_folder(tmp_path: Path, map_path: Path) -> None:
    arguments = ["evaluate", str(map_path), "--seeds", "100-101", "--quick", "--json"]
    here, there = run_command(tmp_path, *arguments), run_command(tmp_path, *arguments, "--cluster", "auto")
    assert there == here
    assert json.loads(there)["behaviors"]


def test_dissect_and_pursue(tmp_path: Path, policy_file: Path) -> None:
    results = []
    for name, where in (("here", ["--workers", "1"]), ("there", ["--cluster", "auto"])):
        folder = tmp_path / name
        folder.mkdir()
        common = ["--policy", str(policy_file), "-o", "ant.toml", "--quick", *where]
        run_command(folder, "dissect", "ant", *common)
        results.append((folder / "ant.toml").read_text())
    assert results[0] == results[1]


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_train(tmp_path: Path, algorithm: str) -> None:
    pytest.importorskip("jax", reason="the extra 'train' is not installed")
    found = []
    for name, where in (("here", []), ("there", ["--cluster", "auto"])):
        arguments = ["train", "ant", "--algorithm", algorithm, "--layers", "8,8", "--steps", "20000"]
        run_command(tmp_path, *arguments, "--folder", name, *where)
        found.append(load_network(tmp_path / name / "best.safetensors"))
    assert found[0].spec == found[1].spec
    for name, tensor in found[0].state_dict().items():
        assert torch.equal(tensor, found[1].state_dict()[name])
