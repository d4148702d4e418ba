from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from pdtui.api import dissect
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome
from pdtui.core.units import Stimulation
from pdtui.dissection.dissection_result import Dissection
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_journal import RolloutJournal
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.probing.stimulated_rollout import RolloutOutcome
from tests.small_dissection import SMALL


class InterruptedHereError(Exception):
    pass


def test_an_interrupted_dissection_goes_on_without_loss(
    policy_file: Path, dissection: Dissection, tmp_path: Path
) -> None:
    def interrupt(stage: str, done: int, of: int) -> None:
        if stage == "refine the best" and done > of // 2:
            raise InterruptedHereError

    journal = tmp_path / "rollouts"
    quick = partial(dissect, "ant", policy_file, episodes=2, workers=1, settings=SMALL)
    with pytest.raises(InterruptedHereError):
        quick(journal=journal, progress=interrupt)
    with RolloutJournal(journal, "") as left:
        assert len(left) > 16 * len(SMALL.screen_values) * SMALL.screen_starts
    resumed, straight = quick(journal=journal), dissection
    assert resumed.behaviors == straight.behaviors
    assert resumed.controllers == straight.controllers
    assert (resumed.rollouts, resumed.control_steps) == (straight.rollouts, straight.control_steps)
    np.testing.assert_array_equal(resumed.refined.effects, straight.refined.effects)
    assert journal.exists()  # until whoever asked for it has saved the results


def test_what_is_known_is_not_run_again_and_anything_else_is(policy_file: Path, tmp_path: Path) -> None:
    with RolloutPool("ant", policy_file, 1) as pool, RolloutJournal(tmp_path / "rollouts", "one") as journal:
        starts = collect_start_states(pool.robot, pool.policy, 1000, 2, at=5)
        plan, other = Stimulation((3,), (2.0,)), Stimulation((3,), (2.5,))
        first = EffectProbe(pool, journal).measure_plans([plan], starts, steps=10)
        known = len(journal)
        again = EffectProbe(pool, journal).measure_plans([plan], starts, steps=10)
        assert len(journal) == known == 4
        np.testing.assert_array_equal(again.effects, first.effects)
        EffectProbe(pool, journal).measure_plans([other], starts, steps=10)
        assert len(journal) == known + 2
        EffectProbe(pool, journal).measure_plans([plan], starts, steps=11)
        assert len(journal) == known + 6


def test_starts_that_differ_only_in_their_random_generator_are_two(policy_file: Path, tmp_path: Path) -> None:
    with RolloutPool("ant", policy_file, 1) as pool, RolloutJournal(tmp_path / "rollouts", "one") as journal:
        (start,) = collect_start_states(pool.robot, pool.policy, 1000, 1, at=5)
        rng = np.random.default_rng(1).bit_generator.state
        other = replace(start, snapshot=replace(start.snapshot, rng=rng))
        EffectProbe(pool, journal).measure_plans([Stimulation((3,), (2.0,))], [start, other], steps=10)
        assert len(journal) == pool.rollouts == 4


@pytest.mark.parametrize("end", [None, *Outcome])
def test_outcomes_keep_every_bit(tmp_path: Path, end: Outcome | None) -> None:
    outcome = RolloutOutcome(np.array([1 / 3, np.nan, -0.0]), float("nan"), 7, end)
    with RolloutJournal(tmp_path / "rollouts", "one") as journal:
        journal.write([b"key"], [outcome])
    with RolloutJournal(tmp_path / "rollouts", "one") as journal:
        known, unknown = journal.read([b"key", b"other"])
    assert unknown is None
    assert known is not None
    assert known.means.tobytes() == outcome.means.tobytes()
    assert np.isnan(known.error)
    assert (known.steps_survived, known.outcome) == (7, end)


def test_a_file_that_is_no_journal_is_named(tmp_path: Path) -> None:
    path = tmp_path / "rollouts"
    path.write_bytes(b"not a database, and longer than a header of SQLite is" * 10)
    with pytest.raises(RobotError, match="expected a journal of roll-outs"):
        RolloutJournal(path, "one")
