"""The table of the driving experiment, from scores that are computed once more here."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from statistics import mean, stdev

import pytest
from rich.console import Console

from pdtui.core.errors import PdtuiError
from pdtui.core.outcome import Outcome
from pdtui.paper.driving.driving_episode import DrivingScore
from pdtui.paper.driving.driving_results import (
    DrivingExperimentResult,
    compare_involvement,
    driving_table,
    summarize_row,
)
from pdtui.paper.driving.driving_score_journal import open_driving_score_journal

OUTCOMES = [
    Outcome(word) for word in ("arrived", "arrived", "left the road", "out of time", "arrived", "crashed")
]


def _score(number: int, involvement: int) -> DrivingScore:
    return DrivingScore(
        f"test-{number}",
        OUTCOMES[number],
        100.0 + 7 * number,
        float(number % 3),
        300,
        involvement,
        involvement,
    )


KEYS = [[_score(number, 2 + (number + repeat) % 3) for number in range(6)] for repeat in range(3)]
TAKEOVER = [[_score(number, 3 * (2 + (number + repeat) % 3)) for number in range(6)] for repeat in range(3)]
ALONE = [[_score(number, 0) for number in range(6)]]


def test_a_row_is_the_mean_and_spread_of_its_repeats() -> None:
    worse = [*KEYS[:2], [replace(one, outcome=Outcome.LEFT_ROAD) for one in KEYS[2]]]
    row = summarize_row("ppo", "keys", "program", worse)
    successes = [3 / 6, 3 / 6, 0.0]
    assert (row.success.mean, row.success.std) == pytest.approx((mean(successes), stdev(successes)))
    assert row.out_of_road.mean == pytest.approx(mean([1 / 6, 1 / 6, 1.0]))
    assert row.reward.mean == pytest.approx(117.5)
    assert row.cost.mean == pytest.approx(1.0)
    assert row.involvement is not None
    each = [mean(one.involvement for one in repeat) for repeat in worse]
    assert (row.involvement.mean, row.involvement.std) == pytest.approx((mean(each), stdev(each)))
    low, high = row.success_share
    assert low < 6 / 18 < high


def test_a_policy_alone_has_no_spread_and_no_involvement() -> None:
    row = summarize_row("ppo", "alone", "", ALONE)
    assert (row.success.mean, row.repeats, row.involvement) == (0.5, 1, None)
    assert math.isnan(row.success.std)


def test_involvement_is_compared_in_the_same_drives() -> None:
    rows = [
        summarize_row("ppo", "alone", "", ALONE),
        summarize_row("ppo", "keys", "program", KEYS),
        summarize_row("ppo", "takeover", "program", TAKEOVER),
        summarize_row("sac", "keys", "program", KEYS),
        summarize_row("ppo", "keys", "person", [KEYS[0]]),
    ]
    (compared,) = compare_involvement(rows)
    assert compared.policy == "ppo"
    # Each drive with a wheel takes three times as many steps: paired, there is no spread.
    ratio = compared.ratio
    assert (ratio.value, ratio.low, ratio.high) == pytest.approx((1 / 3, 1 / 3, 1 / 3))


def test_the_table_says_what_was_driven_and_what_was_not() -> None:
    rows = (
        summarize_row("metadrive", "alone", "", ALONE),
        summarize_row("metadrive", "keys", "program", KEYS),
        summarize_row("metadrive", "keys", "person", [KEYS[0][:1]]),
    )
    result = DrivingExperimentResult(
        "metadrive",
        tuple(f"test-{number}" for number in range(6)),
        3,
        rows,
        compare_involvement(rows),
        {},
        {"metadrive-sac": "no map 'metadrive-sac'"},
        ("mine.rrd",),
    )
    console = Console(width=160, record=True, file=Path("/dev/null").open("w", encoding="utf-8"))  # noqa: SIM115
    console.print(driving_table(result))
    text = console.export_text()
    lines = [" ".join(line.replace("│", " ").split()) for line in text.splitlines()]
    assert "metadrive alone 0.50 0.17 117.5 1.00 –" in lines
    assert any(line.startswith("metadrive H* 0.50 ± 0.00 0.17 ± 0.00 117.5 ± 0.0") for line in lines)
    assert any("H*, a person 1.00" in line for line in lines)
    assert "Not measured: metadrive-sac: no map 'metadrive-sac'" in lines
    assert "People drove 1 times: test-0." in lines
    json.dumps(asdict(result))


def test_a_journal_returns_what_it_kept_and_survives_an_interruption(tmp_path: Path) -> None:
    path = tmp_path / "drives.jsonl"
    journal = open_driving_score_journal(path)
    for number in range(3):
        journal.keep(f"drive {number}", KEYS[0][number])
    with path.open("a") as file:
        file.write('{"drive": "drive 3", "scene": "te')
    again = open_driving_score_journal(path)
    assert [again.find(f"drive {number}") for number in range(4)] == [*KEYS[0][:3], None]
    again.keep("drive 3", KEYS[0][3])
    assert open_driving_score_journal(path).find("drive 3") == KEYS[0][3]
    path.write_text("no score\n" + path.read_text())
    with pytest.raises(PdtuiError, match="line 1: expected the score of a drive"):
        open_driving_score_journal(path)
    assert open_driving_score_journal(None).find("drive 0") is None
