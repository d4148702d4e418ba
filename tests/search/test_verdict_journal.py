"""A search for a task that was killed goes on from its journal."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from pdtui.core.errors import PdtuiError
from pdtui.core.processes.process_start import start_process
from pdtui.dissection.search_task_into_map import WrittenBehavior, search_task_into_map
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.import_options import ImportOptions
from pdtui.robots import RobotSpec
from pdtui.robots.robot_registry import open_robot
from pdtui.search.task_search_settings import QUICK_TASK_SEARCH
from pdtui.search.verdict_journal import PlanJudgingJob, open_verdict_journal

SETTINGS = replace(
    QUICK_TASK_SEARCH,
    values=(6.0,),
    screen_units=4,
    children=2,
    promoted=1,
    generations=2,
    full_seeds=1,
    selection_seeds=2,
    held_out_seeds=1,
)


def _pursue(
    output: Path, journal: Path | None, progress: Callable[[int, int], None] | None = None
) -> WrittenBehavior:
    return search_task_into_map(
        RobotSpec("bipedal_walker"),
        "jump",
        "bipedal_walker",
        output,
        seed=1000,
        workers=1,
        minutes=60.0,
        settings=SETTINGS,
        journal=journal,
        progress=progress,
    )


def _pursue_a_little(output: Path, journal: Path) -> None:
    """Search until this process kills itself, in the second generation."""

    def kill(done: int, total: int) -> None:
        if total == SETTINGS.generations and done == 1:
            os.kill(os.getpid(), signal.SIGKILL)

    _pursue(output, journal, kill)


def test_a_killed_search_goes_on_and_finds_the_same(tmp_path: Path) -> None:
    journal, output, other = tmp_path / "verdicts.jsonl", tmp_path / "jump.toml", tmp_path / "straight.toml"
    process = start_process("search", "pdtui.robots.bipedal_walker", _pursue_a_little, output, journal)
    process.join()
    assert process.exitcode == -signal.SIGKILL
    assert not output.exists()
    kept = journal.read_bytes()
    resumed, straight = _pursue(output, journal), _pursue(other, None)
    assert replace(resumed, output=other) == straight
    assert output.read_bytes() == other.read_bytes()
    whole = journal.read_bytes()
    assert whole.startswith(kept)
    assert 0 < kept.count(b"\n") < whole.count(b"\n")


def test_a_file_that_is_no_journal_is_named_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("my notes\n")
    with pytest.raises(PdtuiError, match="notes.txt: line 1: expected the verdicts on some plans"):
        _pursue(tmp_path / "jump.toml", path)
    assert path.read_text() == "my notes\n"


def test_verdicts_are_not_those_of_weights_that_are_read_otherwise(tmp_path: Path, policy: Policy) -> None:
    path, statistics = tmp_path / "verdicts.jsonl", tmp_path / "statistics.npz"
    job: PlanJudgingJob = ("stop", (), 1000, True)
    statistics.write_bytes(b"one")
    relu = ImportOptions(activation="relu", normalizer=str(statistics))
    with open_robot("ant") as robot:
        journal = open_verdict_journal(path, robot, policy, relu)
        journal.results.keep(journal.key(job), [])
        again = open_verdict_journal(path, robot, policy, relu)
        assert again.results.find(again.key(job)) == []
        tanh = open_verdict_journal(path, robot, policy, replace(relu, activation="tanh"))
        assert tanh.results.find(tanh.key(job)) is None
        statistics.write_bytes(b"other")
        changed = open_verdict_journal(path, robot, policy, relu)
        assert changed.results.find(changed.key(job)) is None
