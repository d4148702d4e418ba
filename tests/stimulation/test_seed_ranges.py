"""Seeds that are kept apart: no search draws a judging seed, and maps say what they were chosen on."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdtui.core.errors import MapError, SeedError
from pdtui.dissection.dissection_config import DissectionConfig
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots.task import Task
from pdtui.search.gains.gain_tuning import tune_gains
from pdtui.search.task_search import TaskSearch
from pdtui.search.task_search_settings import QUICK_TASK_SEARCH
from pdtui.stimulation.map_reader import load_map, parse_map
from pdtui.stimulation.map_writer import add_seeds
from pdtui.stimulation.seed_ranges import (
    JUDGING_SEEDS,
    format_seed_ranges,
    merge_seed_ranges,
    parse_seed_range,
    require_search_seeds,
    require_unused_seeds,
)

TEXT = """# kept
schema = 1
robot = "ant"

[policy]
name = "ant"
sha256 = ""
"""


@pytest.fixture(scope="module")
def walker_pool() -> Iterator[RolloutPool]:
    with RolloutPool("bipedal_walker", "bipedal_walker", workers=1) as pool:
        yield pool


@pytest.fixture
def jump(walker_pool: RolloutPool) -> Task:
    return walker_pool.robot.find_task("jump")


@given(st.lists(st.tuples(st.integers(0, 60), st.integers(1, 9)).map(lambda one: range(one[0], sum(one)))))
def test_merged_ranges_have_the_same_seeds(ranges: list[range]) -> None:
    merged = merge_seed_ranges(ranges)
    assert {seed for one in merged for seed in one} == {seed for one in ranges for seed in one}
    assert all(one.stop < other.start for one, other in pairwise(merged))
    assert tuple(map(parse_seed_range, format_seed_ranges(merged))) == merged


@pytest.mark.parametrize("text", ["", "a", "9-8", "-1", "1-", "1" * 12, "1-2-3"])
def test_what_is_no_range_is_refused(text: str) -> None:
    with pytest.raises(SeedError, match="expected seeds such as"):
        parse_seed_range(text)


def test_a_judging_seed_is_no_search_seed() -> None:
    require_search_seeds(range(1000, 1010), "a search")
    with pytest.raises(SeedError, match="a search: seed 999 is reserved for judging"):
        require_search_seeds(range(999, 1010), "a search")


def test_no_search_can_run_on_a_judging_seed(walker_pool: RolloutPool, jump: Task) -> None:
    with pytest.raises(SeedError, match="a dissection: seed 7 is reserved"):
        DissectionConfig("ant", "ant", seed=7)
    with pytest.raises(SeedError, match="the search for 'jump': seed 7 is reserved"):
        TaskSearch(walker_pool, jump, 7, QUICK_TASK_SEARCH)
    with pytest.raises(SeedError, match="tuning: seed 100 is reserved"):
        tune_gains(None, [], range(100, 104))  # type: ignore[arg-type]


def test_the_figures_of_a_task_search_come_from_judging_seeds(walker_pool: RolloutPool, jump: Task) -> None:
    search = TaskSearch(walker_pool, jump, 5000, QUICK_TASK_SEARCH)
    assert all(seed not in JUDGING_SEEDS for one in search.seeds for seed in one)


def test_a_map_says_on_which_seeds_it_was_chosen() -> None:
    once = add_seeds(TEXT, [range(2000, 2010), 5000], "map")
    again = add_seeds(once, [range(2005, 2020)], "map")
    assert once.startswith("# kept\n")
    assert parse_map(TEXT, "map").seeds is None
    assert parse_map(once, "map").seeds == (range(2000, 2010), range(5000, 5001))
    assert parse_map(again, "map").seeds == (range(2000, 2020), range(5000, 5001))
    with pytest.raises(MapError, match="'seeds': 'x': expected seeds"):
        parse_map(TEXT.replace("robot", 'seeds = ["x"]\nrobot'), "map")


def test_figures_on_seeds_that_something_was_chosen_on_are_refused() -> None:
    used = (range(200, 210),)
    assert require_unused_seeds(range(100, 120), used, "a.toml") == ""
    with pytest.raises(SeedError, match=r"a\.toml: something in this map was chosen on seed 205"):
        require_unused_seeds(range(205, 220), used, "a.toml")
    assert require_unused_seeds(range(100, 120), None, "a.toml") == ""
    assert "does not say" in require_unused_seeds(range(5000, 5001), None, "a.toml")


def test_every_shipped_map_says_its_seeds() -> None:
    maps = sorted((Path(__file__).parents[2] / "maps").glob("*.toml"))
    assert len(maps) >= 6
    for path in maps:
        assert load_map(path).seeds
