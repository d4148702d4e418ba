"""Checkpoints of training runs: safetensors files with JSON in their metadata, replaced atomically."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import TrainingError
from pdtui.core.robot_links_and_state import RobotState
from pdtui.training.robot_batch import RobotBatch, RobotBatchState

_KEY = "pdtui-training"
Arrays = dict[str, NDArray[Any]]


def save_checkpoint(
    path: Path,
    learner: Any,
    batches: Sequence[RobotBatch],
    rng: np.random.Generator,
    progress: dict[str, Any],
    further: Arrays,
) -> None:
    """Write everything that `load_checkpoint` needs to continue bit for bit.

    Args:
        path: The file.
        learner: State of the learner, a tree of arrays.
        batches: The robots.
        rng: Random generator of the run.
        progress: Further JSON data.
        further: Further arrays by name, such as a replay buffer.
    """
    arrays: Arrays = {f"learner.{n}": np.asarray(leaf) for n, leaf in enumerate(jax.tree.leaves(learner))}
    arrays |= {f"memory.{name}": array for name, array in further.items()}
    worlds = []
    for number, batch in enumerate(batches):
        state = batch.state()
        for index, snapshot in enumerate(state.snapshots):
            arrays[f"states.{number}.{index}"] = np.ascontiguousarray(snapshot.state)
            arrays |= {f"worlds.{number}.{index}.{k}": extra for k, extra in enumerate(snapshot.extras)}
        rngs = [dict(snapshot.rng) for snapshot in state.snapshots]
        worlds.append({"robot": state.snapshots[0].robot, "ages": state.ages, "rng": rngs})
    record = {"progress": progress, "rng": rng.bit_generator.state, "worlds": worlds}
    with replace_file(path, TrainingError) as partial:
        save_file(arrays, partial, metadata={_KEY: json.dumps(record)})


def load_checkpoint(
    path: Path, learner: Any, batches: Sequence[RobotBatch], rng: np.random.Generator
) -> tuple[Any, dict[str, Any], Arrays]:
    """Restore robots and generator; return the learner's state, the progress and the further arrays.

    Raises:
        TrainingError: The file is not a checkpoint of a run with the same settings.
    """
    try:
        with safe_open(str(path), framework="numpy") as handle:
            record = json.loads((handle.metadata() or {})[_KEY])
            arrays = {name: handle.get_tensor(name) for name in handle.keys()}  # noqa: SIM118
    except (OSError, SafetensorError, KeyError, ValueError) as error:
        raise TrainingError(f"{path}: expected a checkpoint of `pdtui train`: {error}") from error
    leaves, tree = jax.tree.flatten(learner)
    saved = [arrays.get(f"learner.{index}") for index in range(len(leaves))]
    for index, (leaf, new) in enumerate(zip(leaves, saved, strict=True)):
        if new is None or new.shape != leaf.shape:
            raise TrainingError(
                f"{path}: array {index} of the learner: expected shape {leaf.shape}, "
                f"found {None if new is None else new.shape}; was it made with other settings?"
            )
    for number, (batch, kept) in enumerate(zip(batches, record["worlds"], strict=True)):
        snapshots = []
        for index, robot_rng in enumerate(kept["rng"]):
            extras = _numbered_arrays(arrays, f"worlds.{number}.{index}.")
            snapshots.append(RobotState(kept["robot"], arrays[f"states.{number}.{index}"], extras, robot_rng))
        batch.restore(RobotBatchState(snapshots, kept["ages"]))
    rng.bit_generator.state = record["rng"]
    names = (name for name in arrays if name.startswith("memory."))
    further = {name.removeprefix("memory."): arrays[name] for name in names}
    return jax.tree.unflatten(tree, [jax.numpy.asarray(new) for new in saved]), record["progress"], further


def _numbered_arrays(arrays: Arrays, prefix: str) -> tuple[NDArray[Any], ...]:
    numbers = sorted(int(name.removeprefix(prefix)) for name in arrays if name.startswith(prefix))
    return tuple(arrays[f"{prefix}{number}"] for number in numbers)
