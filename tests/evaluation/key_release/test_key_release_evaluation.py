"""What happens once behaviors are let go: counted on runs made by hand, and on a small policy."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from pdtui.cli import main
from pdtui.core.outcome import Outcome
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.held_run import HeldRunTrace
from pdtui.evaluation.key_release.key_release_evaluation import (
    FOLLOWED_STEPS,
    evaluate_key_releases,
    summarize_key_release,
)
from pdtui.evaluation.key_release.key_release_table import key_release_table
from pdtui.evaluation.protocol_settings import RunTimes
from pdtui.stimulation.stimulation_map import StimulationMap

HELD, BIN = 40, 5
TIMES = RunTimes(press=100, held=HELD, after=FOLLOWED_STEPS, window=20, bin=BIN, dt=0.05)


def _trace(speed: float, outcome: Outcome | None = None, ended_at: int | None = None) -> HeldRunTrace:
    """Return a run at a steady speed, which is NaN from its end on."""
    values = np.full((TIMES.bins, 1), speed)
    if ended_at is not None:
        values[max(0, ended_at) // BIN :] = np.nan
    return HeldRunTrace(values, np.zeros((TIMES.bins, 2)), outcome, ended_at)


def test_falls_count_by_whether_they_come_before_or_after_the_release() -> None:
    held = [
        _trace(2.0, Outcome.FELL, -30),  # before the press
        _trace(2.0, Outcome.FELL, HELD - 1),
        _trace(2.0, Outcome.FELL, HELD),
        _trace(2.0, Outcome.FELL, HELD + 250),
        _trace(2.0, Outcome.ARRIVED, HELD + 20),
        _trace(1.1),
        _trace(0.9),
    ]
    alone = [_trace(2.0) for _ in held]
    alone[1] = _trace(2.0, Outcome.FELL, HELD - 1)
    alone[5] = _trace(2.0, Outcome.FELL, HELD + 200)
    seeds = range(len(held))
    traces = {("it", seed): trace for seed, trace in zip(seeds, held, strict=True)}
    traces |= {("", seed): trace for seed, trace in zip(seeds, alone, strict=True)}
    row = summarize_key_release("it", seeds, {("it", seed): TIMES for seed in seeds}, traces, 0)
    assert (row.failed_while_held, row.let_go, row.failed) == (2, 5, 2)
    assert row.low < 2 / 5 < row.high
    assert (row.failed_by_itself, row.by_itself) == (1, 6)
    assert row.walks_on == 1  # 1.1 of 2.0 m/s; the runs that ended do not
    assert row.held == HELD


@pytest.fixture(scope="module")
def config(small_map: StimulationMap) -> DriveConfig:
    return DriveConfig("ant", small_map, 0)


def test_every_behavior_without_a_target_is_held_and_let_go(config: DriveConfig) -> None:
    told: list[tuple[int, int]] = []
    result = evaluate_key_releases(config, (3, 4), held=20, progress=lambda done, of: told.append((done, of)))
    assert [row.behavior for row in result.behaviors] == ["push", "twitch"]
    assert [row.held for row in result.behaviors] == [20, 10]  # twitch has a period of 0.5 s
    for row in result.behaviors:
        assert row.failed_while_held + row.let_go == 2
        assert row.failed <= row.let_go
    assert told[-1] == (6, 6)
    console = Console(width=120)
    with console.capture() as shown:
        console.print(key_release_table(result))
    assert "twitch" in shown.get()
    assert "hold heading" not in shown.get()


def test_the_command_does_not_take_what_it_would_ignore() -> None:
    refused = CliRunner().invoke(main, ["evaluate", "ant", "--let-go", "--quick"])
    assert "--let-go and --quick are mutually exclusive" in refused.output
    refused = CliRunner().invoke(main, ["evaluate", "ant", "--let-go", "--seeds", "1500"])
    assert "chosen on seed 1500" in refused.output
