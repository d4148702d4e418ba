"""The search for a task: it finds better than nothing, repeats, and writes a map that drives."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from safetensors import safe_open
from safetensors.torch import save_file

from pdtui.cli import main
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.search.evolutionary_search import SharedTimeBudget
from pdtui.search.task_rollout import StimulationWithDuration, judge_stimulations
from pdtui.search.task_search import TaskSearch
from pdtui.search.task_search_settings import QUICK_TASK_SEARCH
from pdtui.stimulation.map_reader import load_map


def test_what_is_found_scores_above_the_untouched_policy_where_it_was_found_and_is_found_again() -> None:
    settings = replace(QUICK_TASK_SEARCH, values=(6.0,), held_out_seeds=3)
    results = []
    for _ in range(2):
        with RolloutPool("bipedal_walker", "bipedal_walker", workers=1) as pool:
            task = pool.robot.find_task("jump")
            search = TaskSearch(pool, task, 1000, settings)
            results.append(search.run(SharedTimeBudget(None).share()))
            untouched = [
                judge_stimulations(pool.robot, pool.policy, task, [StimulationWithDuration()], seed)[0].score
                for seed in search.seeds[0]
            ]
    first, again = results
    assert first.plan == again.plan
    assert first.verdicts == again.verdicts
    # On the walks of the search itself: so small a search need not find anything that holds on others.
    assert first.search_score > np.mean(untouched)


def test_a_search_that_ends_early_starts_anew() -> None:
    small = replace(
        QUICK_TASK_SEARCH, values=(6.0,), screen_units=4, children=2, promoted=1, held_out_seeds=1
    )
    found = []
    for restarts in (0, 2):
        with RolloutPool("bipedal_walker", "bipedal_walker", workers=1) as pool:
            search = TaskSearch(
                pool, pool.robot.find_task("front flip"), 1000, replace(small, restarts=restarts)
            )
            found.append(search.run(SharedTimeBudget(None).share()))
    once, again = found
    assert again.rollouts > once.rollouts
    with RolloutPool("bipedal_walker", "bipedal_walker", workers=1) as pool:
        search = TaskSearch(pool, pool.robot.find_task("front flip"), 1000, replace(small, restarts=2))
        assert search.run(SharedTimeBudget(1e-9).share()).rollouts <= once.rollouts


def test_the_command_writes_a_behavior_and_keeps_what_the_map_says(tmp_path: Path) -> None:
    path = tmp_path / "biped.toml"
    arguments = ["pursue", "bipedal_walker", "jump", "--quick", "--workers", "2", "-o", str(path), "--json"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    told = json.loads(result.output)
    behavior = load_map(path).behaviors["jump"]
    assert behavior.task == "jump"
    assert behavior.magnitudes == told["magnitudes"]
    assert behavior.period == told["period"]
    path.write_text(path.read_text().replace('key = "i"', 'key = "z"  # mine') + "\n# the end\n")
    assert CliRunner().invoke(main, arguments).exit_code == 0
    text = path.read_text()
    assert "# mine" in text
    assert "# the end" in text
    evaluated = CliRunner().invoke(main, ["evaluate", str(path), "--seeds", "100", "--quick", "--json"])
    assert evaluated.exit_code == 0, evaluated.output
    task, *disturbed = json.loads(evaluated.output)["tasks"]
    assert (task["behavior"], task["task"]) == ("jump", "jump")
    assert task["figures"].keys() == task["figures_by_itself"].keys()
    assert (task["condition"], len(task["substitutes"])) == ("undisturbed", 3)
    assert {row["condition"] for row in disturbed} >= {"pushed", "friction −20 %", "mass +20 %"}


def test_a_map_names_the_policy_that_was_searched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file named like a shipped policy is not taken for it."""
    with safe_open(find_weights_file("bipedal_walker"), "pt") as file:
        described = file.metadata()
        tensors = {name: 1.001 * file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    monkeypatch.chdir(tmp_path)
    policy, path = Path("bipedal_walker.safetensors"), Path("maps", "mine.toml")
    save_file(tensors, policy, described)
    arguments = ["pursue", "bipedal_walker", "jump", "--quick", "--policy", str(policy), "-o", str(path)]
    pursued = CliRunner().invoke(main, [*arguments, "--workers", "1"])
    assert pursued.exit_code == 0, pursued.output
    assert load_map(path).policy == f"../{policy}"
    driven = CliRunner().invoke(main, ["drive", str(path), "--headless", "--steps", "3", "--no-record"])
    assert driven.exit_code == 0, driven.output
