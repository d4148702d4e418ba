"""The key of `metadrive-deep` for the lane on the right, an imprint of few units, beside others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("metadrive", reason="the extra 'driving' is not installed")

from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.behavior_evaluation import plan_evaluation
from pdtui.evaluation.held_run import InterventionMeasurement
from pdtui.evaluation.tasks.task_runs import list_task_runs, plan_task_episode, run_task_episode
from pdtui.robots.metadrive import MetaDrive
from pdtui.robots.task import TaskVerdict, average_figures
from pdtui.stimulation.interventions.intervention import Intervention
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map

MAP = load_map(find_map("metadrive-deep"))
KEY = MAP.behaviors["lane right"]
(IMPRINT,) = KEY.interventions
LAYER, WIDTH = 3, 128
JUDGING_SEEDS = range(980, 1000)
# Noisy sensors, which are not run, would need to know how much each observation varies.
UNMEASURED = {"": [InterventionMeasurement(None, np.zeros(275))]}


def _judge(
    imprints: Mapping[str, Intervention], seeds: Sequence[int], *, near: bool
) -> dict[str, list[TaskVerdict]]:
    """Return how the car changes the lane on each seed with each of the imprints in the key's place.

    Args:
        imprints: The imprints by name.
        seeds: The seeds.
        near: Whether all drives keep one engine, which is faster and off by less than a millimeter.
    """
    behaviors = {
        name: replace(KEY, name=name, key=chr(0x4E00 + number), interventions=(one,))
        for number, (name, one) in enumerate(imprints.items())
    }
    plan = plan_evaluation(DriveConfig("metadrive", replace(MAP, behaviors=behaviors), 0), seeds)
    car = plan.loop.robot
    assert isinstance(car, MetaDrive)
    if near:
        car.allow_near_restores()
    verdicts: dict[str, list[TaskVerdict]] = {name: [] for name in imprints}
    for run in list_task_runs(plan):
        if run.pressed and run.kind == "units" and run.condition == "undisturbed":
            episode = plan_task_episode(plan, run, UNMEASURED)
            assert episode is not None
            verdicts[run.behavior].append(run_task_episode(plan.loop, episode).verdict)
    car.close()
    return verdicts


def _count_done(verdicts: Mapping[str, Sequence[TaskVerdict]]) -> dict[str, int]:
    return {name: sum(one.success for one in row) for name, row in verdicts.items()}


def _random_units(draw: int) -> tuple[str, ...]:
    """Return as many units of the layer as the key's, and none of its own."""
    others = [unit for unit in (f"{LAYER}:{index}" for index in range(WIDTH)) if unit not in IMPRINT.units]
    rng = np.random.default_rng(draw)
    return tuple(rng.choice(others, len(IMPRINT.units), replace=False).tolist())


def test_it_changes_the_lane() -> None:
    assert _count_done(_judge({"lane right": IMPRINT}, [1800], near=False)) == {"lane right": 1}


@pytest.mark.slow
def test_it_changes_the_lane_on_most_judging_seeds() -> None:
    verdicts = _judge({"lane right": IMPRINT}, JUDGING_SEEDS, near=False)
    done = _count_done(verdicts)
    print(done, average_figures(verdicts["lane right"]))
    assert done["lane right"] >= 16


@pytest.mark.slow
def test_random_units_with_the_same_edit_do_not() -> None:
    drawn = {f"draw {draw}": replace(IMPRINT, units=_random_units(draw)) for draw in range(24)}
    done = _count_done(_judge({"lane right": IMPRINT, **drawn}, JUDGING_SEEDS[:4], near=True))
    print(done)
    assert sum(done[name] >= done["lane right"] for name in drawn) <= 2


@pytest.mark.slow
def test_editing_the_observation_itself_does_it_with_a_smaller_edit() -> None:
    """All units of the first layer are the same as another observation."""
    sizes = {"smaller": 0.60, "between": 0.66, "the same": 0.72}
    whole = {
        name: replace(IMPRINT, units=("0:*",), values={"heading offset": size})
        for name, size in sizes.items()
    }
    done = _count_done(_judge(whole, JUDGING_SEEDS, near=True))
    print(done)
    assert done["smaller"] >= 16
    assert done["the same"] < 10
