"""Short real drives of the Ant with a small random policy, for the tests of this room."""

from __future__ import annotations

import sys
from pathlib import Path

import torch

from pdtui.core.drive_events import DriveEvent
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.robots import make_robot
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.stimulation_map import Behavior, PidGains, StimulationMap

LAYERS = (24, 16)
TEXT = 'schema = 1\nrobot = "ant"\n# a map with ümläuts and "quotes"\n'


def random_weights(path: Path) -> Path:
    """A policy nobody trained, the same on every call."""
    torch.manual_seed(7)
    network = PolicyNetwork(
        NetworkSpec("ant", 27, LAYERS, "tanh", 8, "squashed_gaussian", (-1.0,) * 8, (1.0,) * 8)
    )
    save_network(path, network)
    return path


def make_loop(weights: Path, seed: int = 5, *, stochastic: bool = False) -> ControlLoop:
    """The Ant, that policy, a fixed behavior, one with a period and one with a controller."""
    policy = load_policy(weights, "ant")
    behaviors = [
        Behavior("go", "w", "goes", {"0:3": 2.0, "1:4": -0.25}, together=("hold",)),
        Behavior("turn", "a", "turns", {"0:7": -1.5}, period=0.5),
        Behavior("hold", "h", "holds", {"0:5": 1.0}, mode="pid", pid=PidGains("yaw", 2, 0.1, 0.1, 3, 0.1)),
    ]
    named = {behavior.name: behavior for behavior in behaviors}
    the_map = StimulationMap("ant", str(weights), policy.sha256, "space", {}, named, text=TEXT)
    return ControlLoop(make_robot("ant"), policy, the_map, seed, stochastic=stochastic)


def events_of(step: int) -> list[DriveEvent]:
    """What the operator does: three keys before step 12, a rewind, a reset."""
    return {
        4: [DriveEvent(4, "behavior", "go", key="w")],
        12: [
            DriveEvent(12, "behavior", "hold", key="h"),
            DriveEvent(12, "target", "hold", 0.1 + 0.2, key="up"),
            DriveEvent(12, "factor", "go", 1.5, key="plus"),
        ],
        40: [DriveEvent(40, "behavior", "turn", key="a")],
        60: [DriveEvent(60, "rewind", value=10, key="backspace")],
        70: [DriveEvent(70, "default", key="space")],
        80: [DriveEvent(80, "reset")],
    }.get(step, [])


def record_drive(
    path: Path, weights: Path, steps: int = 100, *, rows_per_write: int = 64, stochastic: bool = False
) -> tuple[ControlLoop, list[StepRecord]]:
    """Drive and record; returns the loop and what was given to the recorder."""
    loop = make_loop(weights, stochastic=stochastic)
    records = []
    with SessionRecorder(path, loop.info, rows_per_write=rows_per_write) as recorder:
        for step in range(steps):
            records.append(loop.advance(events_of(step)))
            recorder.write(records[-1])
        recorder.close("the operator quit")
    return loop, records


def record_forever(path: Path, weights: Path) -> None:
    """Record until killed, saying after each step which it was."""
    loop = make_loop(weights)
    recorder = SessionRecorder(path, loop.info, rows_per_write=3)
    while True:
        record = loop.advance(events_of(loop.step))
        recorder.write(record)
        print(record.step, record.digest, flush=True)


if __name__ == "__main__":
    record_forever(Path(sys.argv[1]), Path(sys.argv[2]))
