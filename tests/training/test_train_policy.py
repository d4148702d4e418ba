"""`train_policy` refuses choices that the algorithm or the robot does not have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pdtui.core.errors import TrainingError

pytest.importorskip("jax", reason="the extra 'train' is not installed")

from pdtui.training.train_policy import train_policy


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"activation": "relu"}, "--activation is for PPO; SAC trains a tanh network"),
        ({"imitation_rounds": 4}, "--imitation-rounds is for runs that begin with a policy"),
    ],
)
def test_a_choice_that_does_nothing_is_refused(tmp_path: Path, choices: dict[str, Any], message: str) -> None:
    with pytest.raises(TrainingError, match=message):
        train_policy("ant", "sac", 0, 100, None, None, tmp_path, None, **choices)
    assert not list(tmp_path.iterdir())
