"""What the screen sees of a drive: plain data, sent up from the simulation's process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pdtui.sessions.episode_statistics import NO_STATISTICS, EpisodeStatistics

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pdtui.core.attributes import Attribute, Floats
    from pdtui.core.robot_data import Link
    from pdtui.core.step_record import ActiveBehavior


@dataclass(frozen=True)
class DriveFacts:
    """Sent once, when robot and policy are loaded.

    Attributes:
        title: of the robot.
        policy: name of the policy.
        seed: of the drive.
        dt: simulated time of a control step, s.
        attributes, links: of the robot.
        layers: widths of the policy's hidden layers.
        recording: file that the drive is recorded into, empty if it is not.
    """

    title: str
    policy: str
    seed: int
    dt: float
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]
    layers: tuple[int, ...]
    recording: str = ""


@dataclass(frozen=True)
class StimulatedUnit:
    """A stimulated unit: its flat index, what it would have put out and what overwrote it."""

    unit: int
    natural: float
    overwritten: float


@dataclass(frozen=True)
class DriveSnapshot:
    """The latest of the drive. Rows of `history` and `path` are those since the snapshot before.

    Attributes:
        step: control steps done.
        time: simulated time, s.
        episode: number of the episode.
        active: latched behaviors, the latest last.
        units: the stimulated units.
        activations: of every hidden unit, shape (U,).
        attributes: present values, shape (J,).
        poses: body poses, shape (B, 7).
        history: attributes of the steps since the last snapshot, shape (n, J).
        path: x, y in m, and the row in the map of the latest active behavior (−1 for none), shape (n, 3);
            empty for a robot without poses.
        restarted: whether an episode began, or a rewind happened, since the last snapshot: the old path ends.
        paused: whether the pacer waits.
        speed: speed factor that was asked for.
        achieved_speed: speed factor that was reached lately.
        involvement: control steps in which a key was pressed.
        recorded_bytes: size of the recording.
        notice: what the user should read now (a fall, a rewind, a key that does nothing), empty if nothing.
        finished: why the drive is over, empty while it goes on.
        statistics: how the present episode stands.
        obstacles: as `Robot.obstacles`, where they are others than in the snapshot before; else None.
    """

    step: int
    time: float
    episode: int
    active: tuple[ActiveBehavior, ...]
    units: tuple[StimulatedUnit, ...]
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
    recorded_bytes: int = 0
    notice: str = ""
    finished: str = ""
    statistics: EpisodeStatistics = NO_STATISTICS
    obstacles: Floats | None = None
