"""What a drive is to be, as plain data: it travels to the simulation's process."""

from __future__ import annotations

from dataclasses import dataclass

from pdtui.core.events import Event
from pdtui.sessions.session_schema import ActivationsKept
from pdtui.sessions.viewer.viewer_address import ViewerAddress
from pdtui.stimulation.stimulation_map import StimulationMap


@dataclass(frozen=True)
class DriveConfig:
    """What a drive is to be.

    Attributes:
        robot: name of the robot.
        stimulation_map: its behaviors.
        seed: of the drive.
        policy: weights file or shipped name; empty takes the map's.
        stochastic: draw actions instead of taking the mean.
        start: state in which episodes start, empty for the robot's usual one.
        force: drive although the policy is not the map's.
        recording: file to record into, empty for none.
        activations: how they are recorded.
        viewer: where a Rerun viewer listens that is to show a recorded drive; None for none.
        scripted_events: events by step that are played instead of keys, where a session is watched.
        expected_digests: what the watched session left, to compare with.
    """

    robot: str
    stimulation_map: StimulationMap
    seed: int
    policy: str = ""
    stochastic: bool = False
    start: str = ""
    force: bool = False
    recording: str = ""
    activations: ActivationsKept = "all"
    viewer: ViewerAddress | None = None
    scripted_events: tuple[Event, ...] | None = None
    expected_digests: tuple[int, ...] = ()
