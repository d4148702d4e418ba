"""The self-test of a dissection: where nothing is to be found, no more is confirmed than stated."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from pdtui.cli.dissect_command import dissect_command
from pdtui.dissection.dissection_config import DissectionConfig
from pdtui.dissection.null_dissection import NullDissection, NullDraws, count_false_confirmations
from tests.small_dissection import SMALL
from tests.small_worlds import Dot, dot_policy

STATED = replace(
    SMALL, controls=30, refine_starts=2, judge_starts=7, screen_values=(-6.0, 6.0), refine_values=(-6.0, 6.0)
)


@pytest.fixture(scope="module")
def tested() -> NullDissection:
    return count_false_confirmations(
        DissectionConfig(Dot(), dot_policy(), settings=STATED, episodes=2, workers=1), 60
    )


def test_of_nothing_no_more_is_confirmed_than_stated(tested: NullDissection) -> None:
    assert {one.name for one in tested.nulls} == {"without effect", "exchanged"}
    assert tested.smallest_p <= tested.level
    for one in tested.nulls:
        # Three attributes, each with its first match and the unit that seemed to move it most.
        assert 3 * one.draws <= one.pairs <= 6 * one.draws
        assert one.with_any <= one.draws * tested.level + 3 * np.sqrt(one.draws * tested.level)
    assert tested.passes


def test_the_table_says_what_was_confirmed(tested: NullDissection) -> None:
    console = Console(width=160)
    with console.capture() as shown:
        console.print(tested.table())
    assert "no more is confirmed than stated" in shown.get()
    broken = replace(tested, nulls=(NullDraws("exchanged", 100, 20, 600, 40),))
    assert not broken.passes
    with console.capture() as shown:
        console.print(broken.table())
    assert "MORE IS CONFIRMED THAN STATED" in shown.get()
    assert json.loads(json.dumps(broken.as_dict()))["nulls"][0]["with_a_confirmation"] == 20


def test_too_few_starts_are_said_to_confirm_nothing(tested: NullDissection) -> None:
    few = replace(tested, smallest_p=0.25)
    console = Console(width=160)
    with console.capture() as shown:
        console.print(few.table())
    assert "too few starts or units to confirm anything (no p below 0.25)" in shown.get()


def test_the_command_offers_it() -> None:
    help_text = CliRunner().invoke(dissect_command, ["--help"]).output
    assert "--null" in help_text
