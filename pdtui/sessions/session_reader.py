"""Read a session; everything in it is checked, because a session may come from an untrusted source."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.errors import SessionError
from pdtui.core.step_record import ActiveBehavior, ReplacedAction
from pdtui.core.units import Stimulation
from pdtui.sessions.rrd.rrd_contents import RrdContents
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.session_header_decoding import count_control_steps, decode_session_header, read_gaps
from pdtui.sessions.session_schema import ACTIVATIONS, DRIVE, HALF_ACTIVATIONS
from pdtui.sessions.streams.step_block_decoding import decode_activations, decode_step_block


@dataclass(frozen=True, kw_only=True)
class Session(SessionHeader):
    """A recorded drive of S control steps (without its `gaps`), J attributes and A actions.

    Attributes:
        digests: digest of the simulator's state after each step, shape (S,), int64.
        attributes: attributes after each step, shape (S, J).
        actions: action of each step, shape (S, A), float32.
        rewards, costs: reward and cost of each step, shape (S,).
        episodes: number of the episode of each step, shape (S,), int64.
        active: the active behaviors of each step with their controllers, ordered by when they were latched.
        stimulations: for each step, the stimulated units and the values that overwrote their outputs.
        natural: for each step, the outputs that those units would have had.
        replaced_actions: for each step, the components of the action that the operator had taken over.
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
    replaced_actions: tuple[tuple[ReplacedAction, ...], ...] = field(repr=False)

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
    file = RrdContents(path, skip=(ACTIVATIONS, HALF_ACTIVATIONS))
    try:
        drive = file.table(DRIVE)
        header = decode_session_header(file, path, count_control_steps(drive, read_gaps(file)))
        block = decode_step_block(drive, header.info)
        return Session(
            **vars(header),
            digests=block.digests,
            attributes=block.attributes,
            actions=block.actions_as_float32(),
            rewards=block.rewards,
            costs=block.costs,
            episodes=block.episodes,
            active=block.active,
            stimulations=block.stimulations,
            natural=block.natural,
            replaced_actions=block.replaced_actions,
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
    file = RrdContents(path, only=(ACTIVATIONS, HALF_ACTIVATIONS))
    try:
        drive = file.table(DRIVE)
        header = decode_session_header(file, path, count_control_steps(drive, read_gaps(file)))
    except SessionError as error:
        raise SessionError(f"{path}: {error}") from error
    require_activations(header)
    try:
        return decode_activations(drive, header.info).astype(np.float32, copy=False)
    except SessionError as error:
        raise SessionError(f"{path}: {error}") from error


def require_activations(header: SessionHeader) -> None:
    """Check that a session contains activations; one that does not is a `SessionError`."""
    if header.info.activations == "off":
        how = "(--record-activations off); a replay computes them"
        raise SessionError(f"{header.path}: the activations were not recorded {how}")
