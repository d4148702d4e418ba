"""Decode the rows of the drive into a block of control steps; everything in them is checked."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import SessionError
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.session_schema import (
    ACTIVATIONS,
    ACTIVE_FIELDS,
    DIGEST_EPISODE,
    DRIVE,
    HALF_ACTIVATIONS,
    REWARD_COST_ACTION,
)
from pdtui.sessions.streams.step_block import StepBlock


def decode_step_block(
    drive: EntityTable, info: DriveInfo, *, activations: bool = False, **others: Any
) -> StepBlock:
    """Return all rows of a table of the drive; `others` are the fields of the block that it does not have.

    A stream that is missing or damaged is a `SessionError`.
    """
    count = len(drive.steps)
    gains = drive.read_matrix(REWARD_COST_ACTION, np.float64) if count else np.empty((0, 2))
    if gains.shape[1] < 2:
        raise SessionError(f"stream '{DRIVE}/{REWARD_COST_ACTION}': expected reward and cost first")
    counters = drive.read_matrix(DIGEST_EPISODE, np.int64, 2)
    names = drive.read_lists("behaviors", str, optional=True)
    counts = np.fromiter(map(len, names), np.int64, count)
    lengths, states = drive.read_ragged("active", np.float64)
    states = _decode_behavior_states(counts, lengths, states)
    triples, flat = drive.read_ragged("stimulation", np.float64)
    if (triples % 3).any():
        raise SessionError("stream 'stimulation': expected units with two values each")
    stimulated, units = flat.reshape(-1, 3), sum(info.layers)
    chosen = stimulated[:, 0]
    if not ((chosen >= 0) & (chosen < units) & (chosen == np.floor(chosen))).all():
        raise SessionError(f"stream 'stimulation': expected units 0..{units - 1} with two values each")
    pairs, flat = drive.read_ragged("takeover", np.float64)
    if (pairs % 2).any():
        raise SessionError("stream 'takeover': expected components of the action with a value each")
    replaced, components = flat.reshape(-1, 2), gains.shape[1] - 2
    if not np.isin(replaced[:, 0], np.arange(components)).all():
        raise SessionError(f"stream 'takeover': expected components 0..{components - 1} with a value each")
    return StepBlock(
        steps=drive.steps,
        digests=counters[:, 0],
        episodes=counters[:, 1],
        attributes=drive.read_matrix("attributes", np.float64, len(info.attributes)),
        actions=gains[:, 2:],
        rewards=gains[:, 0],
        costs=gains[:, 1],
        behavior_counts=counts,
        behavior_names=list(chain.from_iterable(names)),
        behavior_states=states,
        stimulated_counts=triples // 3,
        stimulated=stimulated,
        replaced_counts=pairs // 2,
        replaced=replaced,
        activations=decode_activations(drive, info) if activations and info.activations != "off" else None,
        **others,
    )


def _decode_behavior_states(counts: NDArray[np.int64], lengths: NDArray[np.int64], flat: Floats) -> Floats:
    """Return the states of active behaviors, shape (sum of the counts, fields).

    Sessions from before behaviors had an onset lack its field, the last, in which no behavior waits.
    """
    fields = len(ACTIVE_FIELDS)
    if np.array_equal(lengths, counts * fields):
        return flat.reshape(-1, fields)
    if np.array_equal(lengths, counts * (fields - 1)):
        return np.pad(flat.reshape(-1, fields - 1), ((0, 0), (0, 1)), constant_values=np.nan)
    raise SessionError(f"stream 'active': expected {fields} numbers per behavior")


def decode_activations(drive: EntityTable, info: DriveInfo) -> NDArray[Any]:
    """Return the output of every hidden unit, shape (n, U), float16 or float32 as it was recorded."""
    units = sum(info.layers)
    if info.activations != "half":
        return drive.read_matrix(ACTIVATIONS, np.float32, units)
    # Sessions of earlier versions have both kinds in the same column.
    name = HALF_ACTIVATIONS if drive.has_column(HALF_ACTIVATIONS) else ACTIVATIONS
    return drive.read_matrix(name, np.float16, units)
