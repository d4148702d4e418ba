"""The configuration of a drive: plain data that is sent to the simulation's process."""

from __future__ import annotations

from dataclasses import dataclass

from pdtui.driving.ghost.ghost_variant import GhostVariant
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.sessions.writer.session_file import ExistingFile, SyncMode
from pdtui.stimulation.stimulation_map import StimulationMap


@dataclass(frozen=True)
class DriveConfig:
    """The configuration of a drive.

    Attributes:
        robot: name of the robot.
        stimulation_map: the behaviors.
        seed: seed of the drive.
        policy: weights file or shipped name; empty for the map's.
        stochastic: draw actions from the policy's distribution instead of taking its mean.
        start: name of the state in which episodes start; empty for the robot's default.
        force: drive even if the policy is not the map's.
        recording: file to record into; empty for none.
        existing: what to do if that file exists.
        sync: when what is recorded is forced to the disk.
        activations: how activations are recorded.
        viewer: address of a Rerun viewer that shows the recorded drive; None for none.
        watched: the session whose events are applied instead of keys, and with which every step is compared;
            None to drive by keys.
        step_times: file for when each control step was done and how late, as a NumPy array; empty for none.
        ghost: what is other in the ghost than that it has no behaviors; None for nothing.
    """

    robot: str
    stimulation_map: StimulationMap
    seed: int
    policy: str = ""
    stochastic: bool = False
    start: str = ""
    force: bool = False
    recording: str = ""
    existing: ExistingFile = "refuse"
    sync: SyncMode = "batch"
    activations: ActivationsKept = "all"
    viewer: ViewerAddress | None = None
    watched: SessionHeader | None = None
    step_times: str = ""
    ghost: GhostVariant | None = None
