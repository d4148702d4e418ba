"""Measures the checkpoints of a training run, each once: what is measured is kept beside them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import PolicyError, RobotError
from pdtui.core.outcome import count_failures
from pdtui.core.processes.result_journal import ResultJournal
from pdtui.core.units import format_unit
from pdtui.dissection.attribute_movers import movable_attribute_columns
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.policy_evaluation import evaluate_policy
from pdtui.policies.weights.weights_header import hash_file
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.start_states import collect_start_states
from pdtui.spectra.episode_monitor import MonitoredEpisode, monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.stimulation.map_library import map_without_behaviors
from pdtui.study.dynamics.learning_dynamics import (
    CheckpointMeasurement,
    DynamicsSettings,
    FinalPrimitives,
    LearningDynamics,
    list_checkpoints,
)

_JOURNAL = "dynamics.jsonl"


def measure_learning_dynamics(
    robot: str,
    folder: Path,
    settings: DynamicsSettings,
    *,
    every: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> LearningDynamics:
    """Measure the checkpoints of a training run.

    What a run of this function measured before, with the same settings, is read from a file in the folder.

    Args:
        robot: Name of the robot.
        folder: Folder of the run.
        settings: How to measure.
        every: Measure every n-th checkpoint, and the last.
        progress: Is told the checkpoints measured, and their number.

    Raises:
        StudyError: There are too few checkpoints.
        PdtuiError: A checkpoint cannot be loaded, or the last one is too bad to have primitives.
    """
    paths = list_checkpoints(folder, every)
    with RolloutPool(robot, paths[-1], 1) as pool:
        names = tuple(one.name for one in pool.robot.attributes)
        primitives = _find_final_primitives(pool, settings)
        units = tuple(format_unit(unit, pool.policy.layers) for unit in primitives.units)
    journal = ResultJournal(
        folder / _JOURNAL, _encode_measurement, _decode_measurement, "the measurement of a checkpoint", "key"
    )
    measured = []
    for number, path in enumerate(paths):
        key = json.dumps([robot, hash_file(path), hash_file(paths[-1]), repr(settings)])
        one = journal.find(key)
        if one is None:
            one = _measure_checkpoint(robot, path, primitives, settings)
            journal.keep(key, one)
        measured.append(one)
        if progress is not None:
            progress(number + 1, len(paths))
    attributes = tuple(names[column] for column in primitives.columns)
    return LearningDynamics(folder.name, robot, attributes, units, tuple(measured))


def _monitor(pool: RolloutPool, settings: DynamicsSettings) -> list[MonitoredEpisode]:
    seeds = range(settings.first_seed, settings.first_seed + settings.episodes)
    return monitor_episodes(pool.robot, pool.policy, seeds, settings.episode_steps)


def _find_final_primitives(pool: RolloutPool, settings: DynamicsSettings) -> FinalPrimitives:
    episodes = _monitor(pool, settings)
    matching = match_units(episodes, pool.robot.attributes, settings.preset)
    columns = [
        column
        for column in movable_attribute_columns(pool.robot.attributes, episodes)
        if len(matching.ranked_units(column))
    ]
    spread = np.concatenate([one.attributes for one in episodes]).std(axis=0)
    drawn = np.random.default_rng(settings.first_seed).integers(pool.policy.units, size=len(columns))
    return FinalPrimitives(
        tuple(columns),
        tuple(int(matching.ranked_units(column)[0]) for column in columns),
        tuple(drawn.tolist()),
        tuple(spread[columns].tolist()),
    )


def _measure_checkpoint(
    robot: str, path: Path, primitives: FinalPrimitives, settings: DynamicsSettings
) -> CheckpointMeasurement:
    drive = DriveConfig(robot, map_without_behaviors(robot, str(path)), 0, str(path))
    score = evaluate_policy(drive, settings.score_seeds, steps=settings.score_steps)
    failures = count_failures(score.outcomes) / len(settings.score_seeds)
    columns, places = list(primitives.columns), range(len(primitives.columns))
    nothing = np.full(len(columns), np.nan)
    own, usual, effects, random_effects = nothing, nothing, nothing, nothing
    with RolloutPool(robot, path, 1) as pool:
        try:
            matching = match_units(_monitor(pool, settings), pool.robot.attributes, settings.preset)
            own = matching.discrepancy[columns, list(primitives.units)]
            usual = np.nanmean(matching.discrepancy[columns], axis=1)
        except PolicyError:
            pass  # every episode is shorter than one window
        try:
            strengths = _measure_strengths(pool, primitives, settings)
            effects, random_effects = (
                np.array([strengths[units[place], place] for place in places])
                for units in (primitives.units, primitives.random)
            )
        except RobotError:
            pass  # the robot does not stay up until a start
    return CheckpointMeasurement(
        int(path.stem),
        score.mean_return,
        1.0 - failures,
        *(tuple(values.tolist()) for values in (own, usual, effects, random_effects)),
    )


def _measure_strengths(
    pool: RolloutPool, primitives: FinalPrimitives, settings: DynamicsSettings
) -> dict[tuple[int, int], float]:
    """Return the strength of each unit for each attribute, by unit and place of the attribute."""
    starts = collect_start_states(
        pool.robot, pool.policy, settings.first_seed + 100, settings.starts, at=settings.start_steps
    )
    units = sorted({*primitives.units, *primitives.random})
    probed = EffectProbe(pool).measure_units(units, settings.values, starts, steps=settings.probed_steps)
    means: Floats = np.abs(probed.counted_effects().mean(axis=2)).max(axis=1)
    return {
        (unit, place): float(means[row, column] / primitives.spread[place])
        for row, unit in enumerate(units)
        for place, column in enumerate(primitives.columns)
    }


def _encode_measurement(measured: CheckpointMeasurement) -> dict[str, Any]:
    return {"measured": asdict(measured)}


def _decode_measurement(fields: dict[str, Any]) -> CheckpointMeasurement:
    measured: dict[str, Any] = fields["measured"]
    lists = {name: tuple(value) for name, value in measured.items() if isinstance(value, list)}
    return CheckpointMeasurement(**{**measured, **lists})
