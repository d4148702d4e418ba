"""Screening by MJX measures what MuJoCo measures."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from pdtui.cli import main


@pytest.mark.slow
def test_effects_on_the_accelerator_are_those_on_the_cpu() -> None:
    pytest.importorskip("jax")
    pytest.importorskip("mujoco.mjx")  # takes seconds to load
    command = ["bench", "accelerator", "--units", "16", "--starts", "2", "--steps", "20", "--json"]
    result = CliRunner(env={"COLUMNS": "120"}).invoke(main, command, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["rollouts"] == (16 * 2 + 1) * 2
    assert found["same_falls"] > 0.95
    by_name = {one["name"]: one for one in found["attributes"]}
    for name in ("vx", "height", "yaw rate", "front right hip torque", "back right ankle torque"):
        assert by_name[name]["correlation"] > 0.8, name
        assert by_name[name]["confirmed"] > 0.7, name
