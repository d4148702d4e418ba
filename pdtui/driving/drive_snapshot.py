"""The messages that the simulation's process sends to the screen, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from pdtui.core.scenery import NO_TRAFFIC
from pdtui.sessions.episode_statistics import NO_STATISTICS, EpisodeStatistics

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pdtui.core.attributes import Attribute, Floats
    from pdtui.core.outcome import Outcome
    from pdtui.core.robot_links_and_state import Link
    from pdtui.core.scenery import Scenery, Traffic
    from pdtui.core.step_record import ActiveBehavior
    from pdtui.driving.ghost.ghost_snapshot import GhostSnapshot
    from pdtui.driving.live_spectra.spectra_snapshot import SpectraSnapshot
    from pdtui.driving.unit_bench.natural_ranges import NaturalRanges
    from pdtui.driving.unit_bench.unit_search_snapshot import UnitSearchSnapshot
    from pdtui.stimulation.stack.stack_entry import StackEntry


@dataclass(frozen=True)
class DriveFacts:
    """The facts of a drive, sent once robot and policy are loaded, and again if the recording moves.

    Attributes:
        title: display name of the robot.
        policy: name of the policy.
        seed: seed of the drive.
        dt: simulated time of a control step, s.
        attributes, links: those of the robot.
        layers: widths of the policy's hidden layers.
        recording: file that the drive is recorded into, or will be; empty if it is not recorded.
        recorded: whether that file was created, which happens with the first control step.
        manual_controls: names of the controls that the operator can take over.
        length: number of control steps of the recording that the drive follows; 0 if it follows none.
        known_keys, known_ends: key presses and ends of episodes of that recording.
        pictured: whether the world is shown by pictures, as it has no links.
        branches: number of times that the drive has branched off; then, it begins again.
        policy_hash: SHA-256 of the policy's weights.
        output_bounds: the least and the largest output that the units of each layer can have by themselves.
    """

    title: str
    policy: str
    seed: int
    dt: float
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]
    layers: tuple[int, ...]
    recording: str = ""
    recorded: bool = False
    manual_controls: tuple[str, ...] = ()
    length: int = 0
    known_keys: tuple[KeyPress, ...] = ()
    known_ends: tuple[EpisodeEnd, ...] = ()
    pictured: bool = False
    branches: int = 0
    policy_hash: str = ""
    output_bounds: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class StimulatedUnit:
    """A stimulated unit: its flat index, its natural output and the value that overwrites it."""

    unit: int
    natural: float
    overwritten: float


class KeyPress(NamedTuple):
    """A key that changed the run.

    Attributes:
        step: the control step before which it applied.
        key: its name.
        behavior: row in the map of the behavior that it latched; −1 for any other key.
    """

    step: int
    key: str
    behavior: int


class EpisodeEnd(NamedTuple):
    """How an episode ended, or that its task was done, with a control step."""

    step: int
    outcome: Outcome


class PastPosition(NamedTuple):
    """Where a past moment lies: number of control steps of the run, and the earliest moment to look at."""

    present: int
    oldest: int


@dataclass(frozen=True)
class DriveSnapshot:
    """The present state of a drive, and its history and path since the last snapshot.

    Attributes:
        step: number of control steps done.
        time: simulated time, s.
        episode: number of the episode.
        active_behaviors: latched behaviors, in the order in which they were latched.
        stimulated_units: the units that they overwrite.
        activations: activation of every hidden unit, shape (U,).
        attributes: present values, shape (J,).
        poses: body poses, shape (B, 7).
        history: attributes of the steps since the last snapshot, shape (n, J).
        path: x, y in m, and the row in the map of the latest active behavior (−1 for none), shape (n, 3);
            empty for a robot without poses.
        restarted: whether an episode or a rewind has begun a new path since the last snapshot.
        paused: whether the drive is paused.
        speed: requested speed, in multiples of real time.
        achieved_speed: speed of the latest steps, in multiples of real time.
        involvement: control steps that count as human involvement.
        arrivals: episodes in which the robot arrived; None for a robot that neither has nor is known to.
        cost: sum of the cost of all steps.
        recorded_bytes: size of the recording, bytes.
        notice: what the user should read now (a fall, a rewind, a key that does nothing); may be empty.
        finished: why the drive is over; empty while it runs.
        statistics: statistics of the present episode.
        manual: name and value of each control that the operator has taken over; empty without a takeover.
        scenery: `Robot.scenery` if it has changed since the last snapshot; else None.
        traffic: what was around the robot after the last step.
        key_presses: keys that changed the run since the last snapshot.
        ends: ends of episodes since the last snapshot.
        picture: picture of a world without links, shape (rows, columns, 3); None where there is no new one.
        spectra: spectrograms of a unit and an attribute, where they were asked for.
        past: where the moment lies that is shown; None for the present.
        ghost: the ghost; None while it is off.
        stack: latched behaviors, muted ones too, in their order.
        held_units: units that the operator holds, by flat index, and their outputs v.
        natural_ranges: the ranges of what the units put out by themselves; None before the first step.
        unit_search: the search for units; None before the first.
    """

    step: int
    time: float
    episode: int
    active_behaviors: tuple[ActiveBehavior, ...]
    stimulated_units: tuple[StimulatedUnit, ...]
    activations: NDArray[np.float32]
    attributes: Floats
    poses: Floats
    history: Floats
    path: Floats
    restarted: bool = False
    paused: bool = False
    speed: float = 1.0
    achieved_speed: float = 1.0
    involvement: int = 0
    arrivals: int | None = None
    cost: float = 0.0
    recorded_bytes: int = 0
    notice: str = ""
    finished: str = ""
    statistics: EpisodeStatistics = NO_STATISTICS
    manual: tuple[tuple[str, float], ...] = ()
    scenery: Scenery | None = None
    traffic: Traffic = NO_TRAFFIC
    key_presses: tuple[KeyPress, ...] = ()
    ends: tuple[EpisodeEnd, ...] = ()
    picture: NDArray[np.uint8] | None = None
    spectra: SpectraSnapshot | None = None
    past: PastPosition | None = None
    ghost: GhostSnapshot | None = None
    stack: tuple[StackEntry, ...] = ()
    held_units: tuple[tuple[int, float], ...] = ()
    natural_ranges: NaturalRanges | None = None
    unit_search: UnitSearchSnapshot | None = None
