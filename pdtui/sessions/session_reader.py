"""Read a session; everything in it is checked, because a session may come from an untrusted source."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import SessionError
from pdtui.core.step_record import ActiveBehavior
from pdtui.core.units import Stimulation
from pdtui.sessions.drive_info import decode_drive_info
from pdtui.sessions.rrd.entity_table import EntityTable
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_header import SessionHeader, count_control_steps, decode_header, read_gaps
from pdtui.sessions.session_schema import ACTIVE_FIELDS, DIGEST_EPISODE, DRIVE, INFO, REWARD_COST_ACTION


@dataclass(frozen=True, kw_only=True)
class Session(SessionHeader):
    """A recorded drive of S control steps, J attributes and A actions.

    Attributes:
        digests: digest of the simulator's state after each step, shape (S,), int64.
        attributes: attributes after each step, shape (S, J).
        actions: action of each step, shape (S, A), float32.
        rewards, costs: reward and cost of each step, shape (S,).
        episodes: number of the episode of each step, shape (S,), int64.
        active: the active behaviors of each step with their controllers, ordered by when they were latched.
        stimulations: for each step, the stimulated units and the values that overwrote their outputs.
        natural: for each step, the outputs that those units would have had.
    """

    digests: NDArray[np.int64] = field(repr=False)
    attributes: Floats = field(repr=False)
    actions: NDArray[np.float32] = field(repr=False)
    rewards: Floats = field(repr=False)
    costs: Floats = field(repr=False)
    episodes: NDArray[np.int64] = field(repr=False)
    active: tuple[tuple[ActiveBehavior, ...], ...] = field(repr=False)
    stimulations: tuple[Stimulation, ...] = field(repr=False)
    natural: tuple[tuple[float, ...], ...] = field(repr=False)

    @property
    def behaviors(self) -> tuple[tuple[str, ...], ...]:
        """The names of the active behaviors of each step."""
        return tuple(tuple(behavior.name for behavior in step) for step in self.active)


def read_session(path: Path | str) -> Session:
    """Read a session except its activations, whether or not the file ends with an index.

    Raises:
        SessionError: the file does not exist, is no session, or is damaged or incomplete; the message names
            the file and says what is wrong.
    """
    path = Path(path)
    file = RrdContents(path, skip=("activations",))
    try:
        drive = file.table(DRIVE)
        header = decode_header(file, path, count_control_steps(drive, read_gaps(file)))
        info = header.info
        gains = drive.read_matrix(REWARD_COST_ACTION, np.float64)
        if header.steps and gains.shape[1] < 2:
            raise SessionError(f"stream '{DRIVE}/{REWARD_COST_ACTION}': expected reward and cost first")
        gains = gains if header.steps else np.empty((0, 2))
        counters = drive.read_matrix(DIGEST_EPISODE, np.int64, 2)
        stimulations, natural = _read_stimulations(drive, sum(info.layers))
        return Session(
            **vars(header),
            digests=counters[:, 0],
            attributes=drive.read_matrix("attributes", np.float64, len(info.attributes)),
            actions=gains[:, 2:].astype(np.float32),
            rewards=gains[:, 0],
            costs=gains[:, 1],
            episodes=counters[:, 1],
            active=_read_active_behaviors(drive),
            stimulations=stimulations,
            natural=natural,
        )
    except SessionError as error:
        raise SessionError(f"{path}: {error}") from error


def read_activations(path: Path | str) -> NDArray[np.float32]:
    """Read the output of every hidden unit in every step, as the next layer received it, shape (S, U).

    If they were recorded as float16, they are rounded to 11 bits.

    Raises:
        SessionError: as `read_session`; or the activations were not recorded.
    """
    path = Path(path)
    file = RrdContents(path, only=("activations",))
    try:
        info, _ = decode_drive_info(file.properties(INFO))
        drive = file.table(DRIVE)
        count_control_steps(drive, read_gaps(file))
        if info.activations == "off":
            how = "(--record-activations off); a replay computes them"
            raise SessionError(f"the activations were not recorded {how}")
        kind = np.float16 if info.activations == "half" else np.float32
        return drive.read_matrix("activations", kind, sum(info.layers)).astype(np.float32, copy=False)
    except SessionError as error:
        raise SessionError(f"{path}: {error}") from error


def _read_active_behaviors(drive: EntityTable) -> tuple[tuple[ActiveBehavior, ...], ...]:
    width = len(ACTIVE_FIELDS)
    steps = []
    states = drive.read_lists("active", float, optional=True)
    for names, flat in zip(drive.read_lists("behaviors", str, optional=True), states, strict=True):
        if len(flat) != len(names) * width:
            raise SessionError(f"stream 'active': expected {width} numbers per behavior")
        parts = [flat[start : start + width] for start in range(0, len(flat), width)]
        steps.append(tuple(map(_decode_active_behavior, names, parts)))
    return tuple(steps)


def _decode_active_behavior(name: str, values: Sequence[float]) -> ActiveBehavior:
    remaining, factor, *controller = (None if math.isnan(value) else value for value in values)
    steps = None if remaining is None or math.isinf(remaining) else int(remaining)
    return ActiveBehavior(name, steps, math.nan if factor is None else factor, *controller)


def _read_stimulations(
    drive: EntityTable, units: int
) -> tuple[tuple[Stimulation, ...], tuple[tuple[float, ...], ...]]:
    stimulations, natural = [], []
    for flat in drive.read_lists("stimulation", float, optional=True):
        chosen, values, unstimulated = flat[::3], flat[1::3], flat[2::3]
        if len(flat) % 3 or not all(unit.is_integer() and 0 <= unit < units for unit in chosen):
            raise SessionError(f"stream 'stimulation': expected units 0..{units - 1} with two values each")
        stimulations.append(Stimulation(tuple(int(unit) for unit in chosen), tuple(values)))
        natural.append(tuple(unstimulated))
    return tuple(stimulations), tuple(natural)
