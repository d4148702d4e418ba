"""Training state on disk: arrays in safetensors, the rest as JSON beside them, replaced in one step."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from pdtui.errors import TrainingError
from pdtui.robots.base import RobotSnapshot
from pdtui.training.replay import ReplayBuffer
from pdtui.training.sac import LearnerState
from pdtui.training.worlds import Worlds, WorldsState

_KEY = "pdtui-training"


def save_checkpoint(
    path: Path,
    learner: LearnerState,
    replay: ReplayBuffer,
    worlds: Worlds,
    rng: np.random.Generator,
    progress: dict[str, Any],
) -> None:
    """Write all that a later `load_checkpoint` needs to go on bit for bit."""
    state = worlds.state()
    arrays: dict[str, NDArray[Any]] = {
        f"learner.{index}": np.asarray(leaf) for index, leaf in enumerate(jax.tree.leaves(learner))
    }
    arrays |= replay.export()
    arrays["worlds.state"] = np.array([snapshot.state for snapshot in state.snapshots])
    for index, snapshot in enumerate(state.snapshots):
        arrays |= {f"worlds.{index}.extra.{k}": extra for k, extra in enumerate(snapshot.extras)}
    record = {
        "progress": progress,
        "count": replay.count,
        "rng": rng.bit_generator.state,
        "ages": state.ages,
        "robot": state.snapshots[0].robot,
        "world_rng": [snapshot.rng for snapshot in state.snapshots],
    }
    partial = path.with_name(path.name + ".part")
    save_file(arrays, partial, metadata={_KEY: json.dumps(record)})
    partial.replace(path)


def load_checkpoint(
    path: Path, learner: LearnerState, replay: ReplayBuffer, worlds: Worlds, rng: np.random.Generator
) -> tuple[LearnerState, dict[str, Any]]:
    """Fill replay, worlds and rng, and return the learner's state and the progress.

    Raises:
        TrainingError: the file is not a checkpoint of this robot and these settings.
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
    replay.load(arrays, int(record["count"]))
    rng.bit_generator.state = record["rng"]
    snapshots = []
    for index, world_rng in enumerate(record["world_rng"]):
        prefix = f"worlds.{index}.extra."
        extras = tuple(arrays[name] for name in sorted(arrays) if name.startswith(prefix))
        snapshots.append(RobotSnapshot(record["robot"], arrays["worlds.state"][index], extras, world_rng))
    worlds.restore(WorldsState(snapshots, record["ages"]))
    return jax.tree.unflatten(tree, [jax.numpy.asarray(new) for new in saved]), record["progress"]
