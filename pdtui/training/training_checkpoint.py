"""Training state on disk: arrays in safetensors, the rest as JSON beside them, replaced in one step."""

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
from pdtui.core.robot_data import RobotState
from pdtui.training.world_batch import WorldBatch, WorldBatchState

_KEY = "pdtui-training"
Arrays = dict[str, NDArray[Any]]


def save_checkpoint(
    path: Path,
    learner: Any,
    worlds: Sequence[WorldBatch],
    rng: np.random.Generator,
    progress: dict[str, Any],
    memory: Arrays,
) -> None:
    """Write all that a later `load_checkpoint` needs to go on bit for bit.

    Args:
        path: of the file.
        learner: a tree of arrays.
        worlds: groups of robots.
        rng: of the run.
        progress: what else the run remembers, JSON-able.
        memory: further arrays by name, such as a replay buffer.
    """
    arrays: Arrays = {
        f"learner.{index}": np.asarray(leaf) for index, leaf in enumerate(jax.tree.leaves(learner))
    }
    arrays |= {f"memory.{name}": array for name, array in memory.items()}
    groups = []
    for number, group in enumerate(worlds):
        state = group.state()
        for index, snapshot in enumerate(state.snapshots):
            arrays[f"states.{number}.{index}"] = np.ascontiguousarray(snapshot.state)
            extras = {f"worlds.{number}.{index}.{k}": extra for k, extra in enumerate(snapshot.extras)}
            arrays |= extras
        groups.append(
            {
                "robot": state.snapshots[0].robot,
                "ages": state.ages,
                "rng": [dict(snapshot.rng) for snapshot in state.snapshots],
            }
        )
    record = {"progress": progress, "rng": rng.bit_generator.state, "worlds": groups}
    with replace_file(path, TrainingError) as partial:
        save_file(arrays, partial, metadata={_KEY: json.dumps(record)})


def load_checkpoint(
    path: Path, learner: Any, worlds: Sequence[WorldBatch], rng: np.random.Generator
) -> tuple[Any, dict[str, Any], Arrays]:
    """Fill worlds and rng; return the learner's state, the progress and the further arrays.

    Raises:
        TrainingError: the file is not a checkpoint of this run's settings.
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
    for number, (group, kept) in enumerate(zip(worlds, record["worlds"], strict=True)):
        snapshots = []
        for index, world_rng in enumerate(kept["rng"]):
            prefix = f"worlds.{number}.{index}."
            places = sorted(int(name.removeprefix(prefix)) for name in arrays if name.startswith(prefix))
            extras = tuple(arrays[f"{prefix}{place}"] for place in places)
            state = arrays[f"states.{number}.{index}"]
            snapshots.append(RobotState(kept["robot"], state, extras, world_rng))
        group.restore(WorldBatchState(snapshots, kept["ages"]))
    rng.bit_generator.state = record["rng"]
    memory = {
        name.removeprefix("memory."): array for name, array in arrays.items() if name.startswith("memory.")
    }
    return jax.tree.unflatten(tree, [jax.numpy.asarray(new) for new in saved]), record["progress"], memory
