from __future__ import annotations

import json

from click.testing import CliRunner

from pdtui.cli import main

SMALL = ["--rollouts", "8", "--steps", "10", "--rounds", "1", "--workers", "1"]


def test_roll_outs_one_by_one_and_in_lock_step_are_compared_in_one_run() -> None:
    result = CliRunner().invoke(main, ["bench", "rollouts", "anymal", *SMALL, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert min(found["bare"], found["one_by_one"], found["lockstep"]) > 0
    assert found["same_order"] == 1.0
    assert 0 <= found["difference"] < 1e-2


def test_a_robot_that_runs_them_one_by_one_is_told_so() -> None:
    result = CliRunner().invoke(main, ["bench", "rollouts", "walker", *SMALL])
    assert result.exit_code == 1
    assert "here, they run one by one" in result.output
